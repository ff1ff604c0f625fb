// The connected components of a mesh, and how large each is.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

struct Components {
    Array<int32_t> labels;  // of vertices, components numbered by their first vertices; -1 for vertices of no triangle
    int32_t count = 0;
};

// Triangles with a common vertex are of one component.
Components connected_components(const Triangles& triangles);

struct Sizes {
    Array<double> volumes;     // signed, from outermost[0]: dust keeps its digits
    Array<double> areas;
    Array<double> vectors;     // [count, 3], sums of the triangles' vector areas
    Array<int32_t> outermost;  // [count, 6], the first vertices farthest out along -x, -y, -z, x, y and z
    Array<int64_t> flat;       // triangles without area
};

// labels: of the vertices, each below count.
Sizes component_sizes(const MeshView& mesh, std::span<const int32_t> labels, size_t count);

// --- Which shell of a mesh lies inside which.

struct Nesting {
    Array<int64_t> winding;  // how often others surround each shell
    Array<int64_t> parent;   // the smallest of these, or -1
};

// A ray from one vertex of each shell, first[shell], goes up and adds the winding of every triangle it passes; edges and
// vertices on the ray count once (half-open edges). Shells with -1 for a vertex are not looked at. labels: the shell of each
// vertex; sizes: the volume of each shell.
Nesting nesting(const MeshView& mesh, std::span<const int32_t> labels, std::span<const double> sizes,
                std::span<const int64_t> first);

// --- Bodies that come near each other.

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
