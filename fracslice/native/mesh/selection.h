// Submeshes: some triangles of a mesh, or those near some of them.
#pragma once
#include <span>
#include <vector>

#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

struct Selection {
    Array<double> vertices;    // those that the triangles use, in order
    Array<int32_t> triangles;
};

// keep: of each triangle. Of a mesh that stays as it is, only how much that is.
Selection selected(const MeshView& mesh, std::span<const bool> keep);

struct Ordered {
    Array<int32_t> first;      // of the vertices in use, by their first use: its number before
    Array<int32_t> triangles;  // with new numbers
};

// The vertices by their first use.
Ordered in_order(const Triangles& triangles);

// The triangles with a corner among some vertices, ascending.
std::vector<int64_t> touching(const Triangles& triangles, std::span<const bool> vertices);

// The triangles with a corner near some points [n, 3], ascending: all that are within `reach` of one along each axis, and others.
std::vector<int64_t> near(const MeshView& mesh, std::span<const double> points, double reach);

// The triangles that may meet one of some, these included, ascending: those with a box in the same cells of a coarse grid.
std::vector<int64_t> surroundings(const MeshView& mesh, std::span<const bool> of);

}  // namespace fracslice::mesh
