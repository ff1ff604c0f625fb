// Bodies that come near each other.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "vec3.h"

namespace fracslice::mesh {

struct Cubes {
    Vec3 origin;
    double edge;
};

struct LabelledPoints {
    const double* points;             // [labels.size(), 3]
    std::span<const int32_t> labels;  // each below bodies.size()
    std::span<const int32_t> bodies;  // of the labels; -1 for none
};

// Bodies with a point in a cube that holds a point of another body, ascending; the cubes are those of two lattices, half a cube
// from each other. The largest body, the one of most points, costs no memory.
std::vector<int64_t> near_bodies(const LabelledPoints& all, size_t count, int32_t largest, const Cubes& cubes);

}  // namespace fracslice::mesh
