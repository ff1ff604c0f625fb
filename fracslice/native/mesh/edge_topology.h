// How triangles hang together: the edges and fans around every vertex.
#pragma once
#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

// Corners grouped by vertex; corner k of triangle t is 3 t + k.
struct CornersByVertex {
    Array<int64_t> start;   // [vertices + 1]
    Array<int64_t> corner;  // [3 count]
};

CornersByVertex corners_by_vertex(const Triangles& triangles);

// Sums over vertices. An edge is counted at both ends; non_manifold: of more than two triangles; misoriented: of triangles that
// traverse it in the same direction.
struct EdgeCounts {
    int64_t edges = 0, open = 0, non_manifold = 0, misoriented = 0, extra_fans = 0;
};

// At the vertices where counted is true: [vertices]. Triangles with two equal corners do not count.
EdgeCounts edge_counts(const Triangles& triangles, const bool* counted);

}  // namespace fracslice::mesh
