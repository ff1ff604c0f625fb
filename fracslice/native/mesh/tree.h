// A tree of boxes over the triangles of a mesh, for questions about neighbours in space: triangles in Morton order
// (G. M. Morton, 1966), cut into runs of kLeaf. `TreeView` says how it is laid out.
#pragma once
#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

struct Tree {
    Array<int64_t> order;
    Array<double> low, high;
};

// For a mesh with at least one triangle, fewer than 2^32.
Tree build_tree(const MeshView& mesh);

}  // namespace fracslice::mesh
