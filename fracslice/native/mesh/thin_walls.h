// Where a mesh is thinner than a limit: rays from its triangles, along their normals inwards.
#pragma once
#include <array>
#include <vector>

#include "triangles.h"

namespace fracslice::mesh {

// The thinnest ray of a triangle: its length, the area whose rays are as thin, and its middle.
using ThinWall = std::array<double, 5>;

// Of the first `count` triangles those with a ray shorter than `limit` to a face that looks away from them. Of a large
// triangle there are rays from the middles and corners of equal parts. One that leaves through a neighbour, at an edge, finds none.
std::vector<ThinWall> thin_walls(const MeshView& mesh, const TreeView& tree, size_t count, double limit);

}  // namespace fracslice::mesh
