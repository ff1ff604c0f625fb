// What leaves a mesh: triangles as binary STL holds them, rows of text, and a small picture (`Mesh._repr_png_`).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "../array.h"
#include "triangles.h"

// Submeshes: some triangles of a mesh, or those near some of them.

namespace fracslice::mesh {

struct Selection {
    Array<double> vertices;    // those that the triangles use, in order
    Array<int32_t> triangles;
};

// keep: of each triangle. Of a mesh that stays as it is, only how much that is.
Selection selected(const MeshView& mesh, std::span<const bool> keep);

struct Ordered {
    Array<int32_t> first;      // of the vertices in use, by their first use: its number before
    Array<int32_t> triangles;  // with new numbers
};

// The vertices by their first use.
Ordered in_order(const Triangles& triangles);

// The triangles with a corner among some vertices, ascending.
std::vector<int64_t> touching(const Triangles& triangles, std::span<const bool> vertices);

// The triangles with a corner near some points [n, 3], ascending: all that are within `reach` of one along each axis, and others.
std::vector<int64_t> near(const MeshView& mesh, std::span<const double> points, double reach);

// The triangles that may meet one of some, these included, ascending: those with a box in the same cells of a coarse grid.
std::vector<int64_t> surroundings(const MeshView& mesh, std::span<const bool> of);

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
