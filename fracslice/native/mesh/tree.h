// A tree of boxes over the triangles of a mesh, for questions about neighbours in space: triangles in Morton order
// (G. M. Morton, 1966), cut into runs of kLeaf. `TreeView` says how it is laid out. And which triangles cut others, by it.
#pragma once
#include <array>
#include <vector>

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

// Where a mesh is thinner than a limit: rays from its triangles, along their normals inwards.

// The thinnest ray of a triangle: its length, the area whose rays are as thin, and its middle.
using ThinWall = std::array<double, 5>;

// Of the first `count` triangles those with a ray shorter than `limit` to a face that looks away from them. Of a large
// triangle there are rays from the middles and corners of equal parts. One that leaves through a neighbour, at an edge, finds none.
std::vector<ThinWall> thin_walls(const MeshView& mesh, const TreeView& tree, size_t count, double limit);

}  // namespace fracslice::mesh
