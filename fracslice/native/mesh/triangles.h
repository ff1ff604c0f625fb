// A view of the arrays of fracslice.mesh.model.Mesh, and a tree of boxes over its triangles.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace fracslice::mesh {

using Vec3 = std::array<double, 3>;

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec3 operator*(double s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Corner indices, each below `vertices`: the bindings see to that.
struct Triangles {
    const int32_t* corners;  // [count, 3]
    size_t count, vertices;

    const int32_t* operator[](size_t t) const { return corners + 3 * t; }
};

struct MeshView : Triangles {
    const double* positions;  // [vertices, 3]

    const double* point(int32_t v) const { return positions + 3 * size_t(v); }
    const double* corner(size_t t, int k) const { return point(corners[3 * t + size_t(k)]); }
};

// Triangles in a leaf of a tree.
constexpr size_t kLeaf = 8;

// As `fracslice.mesh.model.Tree` has it: a complete binary tree as a heap, the root at 1, the children of node i at 2 i and
// 2 i + 1; leaf k has the triangles order[kLeaf k] to order[kLeaf k + kLeaf - 1]. Empty boxes have low above high.
struct TreeView {
    const int64_t* order;        // [count]
    const double *low, *high;    // [2 leaves, 3]
    size_t count, leaves;

    size_t first(size_t leaf) const { return leaf * kLeaf; }
    size_t last(size_t leaf) const { return std::min(count, first(leaf) + kLeaf); }
};

}  // namespace fracslice::mesh
