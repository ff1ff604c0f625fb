// The connected components of a mesh, and how large each is.
#pragma once
#include <array>
#include <span>

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

}  // namespace fracslice::mesh
