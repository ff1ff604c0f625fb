// What leaves a mesh: triangles as binary STL holds them, rows of text, and a small picture (`Mesh._repr_png_`).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "triangles.h"

namespace fracslice::mesh {

// Unit normal and corners in float32, and an attribute of two bytes.
constexpr size_t kStlBytes = 50;

// out: [count, kStlBytes]. The normal of a triangle without area is zero.
void write_stl(const MeshView& mesh, uint8_t* out);

// --- Numbers as text, row by row.

// Rows of as many numbers as there are texts, each after its own text; `end` ends a row. A float has the fewest digits that
// read back as the same number. `values`: whole rows. Number: float or int64_t.
template <class Number>
std::string text_rows(std::span<const Number> values, const std::vector<std::string>& before, const std::string& end);

// The number of the foremost triangle at the centre of each pixel, -1 where there is none; x and y of the mesh are pixels.
std::vector<int32_t> foremost(const MeshView& mesh, int height, int width);

}  // namespace fracslice::mesh
