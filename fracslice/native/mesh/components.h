// The connected components of a mesh, and how large each is.
#pragma once
#include <span>

#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

struct Components {
    Array<int32_t> labels;  // of triangles, numbered by first appearance
    int32_t count = 0;
};

// Triangles with a common vertex are of one component.
Components connected_components(const Triangles& triangles);

struct Sizes {
    Array<double> volumes;  // signed, from a vertex of the component's own: dust keeps its digits
    Array<double> areas;
};

// labels: of the triangles, each below count.
Sizes component_sizes(const MeshView& mesh, std::span<const int32_t> labels, size_t count);

}  // namespace fracslice::mesh
