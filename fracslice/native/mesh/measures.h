// Triangles of a mesh that rounding turns over, pointed vertices, and the bounding box.
#pragma once
#include <limits>
#include <span>
#include <vector>

#include "quantise.h"

namespace fracslice::mesh {

// The triangles, in order, that are flat or turn by a right angle or more when they are quantised.
std::vector<int64_t> turned(const MeshView& mesh, const Frame& frame);

// The vertices, in order, from which all edges fall off, at an angle of at least that sine. On a surface that has more than
// `most` of them, only some.
std::vector<int64_t> pointed(const MeshView& mesh, double sine, size_t most);

// The box around some points; low above high if there are none.
struct Bounds {
    static constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Vec3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
};

// points: [n, 3].
Bounds bounds(std::span<const double> points);

}  // namespace fracslice::mesh
