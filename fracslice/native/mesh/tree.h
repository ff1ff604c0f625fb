// A tree of boxes over the triangles of a mesh, for questions about neighbours in space: triangles in Morton order
// (G. M. Morton, 1966), cut into runs of kLeaf. `TreeView` says how it is laid out. And which triangles cut others, by it.
#pragma once
#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

struct Tree {
    Array<int64_t> order;
    Array<double> low, high;
};

// For a mesh with at least one triangle, fewer than 2^32. halved: triangles are cut in halves of a side again and again in place
// of Morton order. That takes three times as long, and searches for the nearest one a fifth.
Tree build_tree(const MeshView& mesh, bool halved = false);

// For each triangle whether it meets another one in more than what the vertices both have by index span. Triangles without
// area are passed over. among: only pairs with one of these are looked at, [count]; all if null.
Array<bool> self_intersecting_triangles(const MeshView& mesh, const TreeView& tree, const bool* among = nullptr);

}  // namespace fracslice::mesh
