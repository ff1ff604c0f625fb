// A small picture of a mesh: `fracslice.mesh.thumbnail`.
#pragma once
#include <vector>

#include "triangles.h"

namespace fracslice::mesh {

// The number of the foremost triangle at the centre of each pixel, -1 where there is none; x and y of the mesh are pixels.
std::vector<int32_t> foremost(const MeshView& mesh, int height, int width);

}  // namespace fracslice::mesh
