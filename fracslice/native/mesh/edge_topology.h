// How triangles hang together: the edges and fans around every vertex, and the parts they form.
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

// Sums over vertices. An edge is counted at both ends; crowded: of more than two triangles; misoriented: of triangles that
// do not run in opposite ways.
struct Links {
    int64_t edges = 0, open = 0, crowded = 0, misoriented = 0, extra_fans = 0;
};

// At the vertices where counted is true: [vertices]. Triangles have three different corners.
Links links(const Triangles& triangles, const bool* counted);

struct Parts {
    Array<int32_t> labels;  // of triangles, numbered by first appearance
    int32_t count = 0;
};

// Triangles with a common vertex are of one part.
Parts parts(const Triangles& triangles);

// The signed volume of each part, measured from a vertex of its own: dust keeps its digits. labels: of the triangles, each below
// parts.
Array<double> shell_volumes(const MeshView& mesh, const int32_t* labels, size_t parts);

}  // namespace fracslice::mesh
