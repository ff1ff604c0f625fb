// Triangles as binary STL holds them.
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

}  // namespace fracslice::mesh
