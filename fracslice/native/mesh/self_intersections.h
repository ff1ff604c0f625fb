// Which triangles of a mesh cut, touch or cover others.
#pragma once
#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

// For each triangle whether it meets another one in more than what the vertices both have by index span. Triangles without
// area are passed over. among: only pairs with one of these are looked at, [count]; all if null.
Array<bool> self_intersecting_triangles(const MeshView& mesh, const TreeView& tree, const bool* among = nullptr);

}  // namespace fracslice::mesh
