// Triangles as binary STL holds them.
#pragma once
#include <cstdint>

#include "triangles.h"

namespace fracslice::mesh {

// Unit normal and corners in float32, and an attribute of two bytes.
constexpr size_t kStlBytes = 50;

// out: [count, kStlBytes]. The normal of a triangle without area is zero.
void write_stl(const MeshView& mesh, uint8_t* out);

}  // namespace fracslice::mesh
