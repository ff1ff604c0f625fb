// A view of the arrays of fracslice.mesh.model.Mesh, and a tree of boxes over its triangles.
#pragma once
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

// Work in blocks of equal size: the results of the blocks are joined in order, so that they are the same for any number of
// threads.

namespace fracslice::mesh {

constexpr size_t kBlock = size_t(1) << 14;

constexpr size_t blocks_of(size_t count) { return (count + kBlock - 1) / kBlock; }

// Calls act(block, first, last) for each block of `count` things.
template <class Do>
void for_each_block(size_t count, const Do& act) {
    tbb::parallel_for(size_t(0), blocks_of(count), [&](size_t k) { act(k, k * kBlock, std::min(count, (k + 1) * kBlock)); });
}

// Calls act(number) for each number below `count`.
template <class Do>
void for_each_number(size_t count, const Do& act) {
    for_each_block(count, [&](size_t, size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) act(i);
    });
}

// What act(first, last) returns for each block of `count` things.
template <class Part, class Do>
std::vector<Part> in_blocks(size_t count, const Do& act) {
    std::vector<Part> parts(blocks_of(count));
    for_each_block(count, [&](size_t k, size_t first, size_t last) { parts[k] = act(first, last); });
    return parts;
}

template <class T>
std::vector<T> joined(const std::vector<std::vector<T>>& parts) {
    std::vector<T> all;
    for (const std::vector<T>& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

// The numbers below `count` for which choose(number) holds, ascending.
template <class Do>
std::vector<int64_t> chosen(size_t count, const Do& choose) {
    return joined(in_blocks<std::vector<int64_t>>(count, [&](size_t first, size_t last) {
        std::vector<int64_t> result;
        for (size_t i = first; i < last; ++i) {
            if (choose(i)) result.push_back(int64_t(i));
        }
        return result;
    }));
}

// Of each block of `count` things how many before it hold, and behind the last how many in all.
template <class Do>
std::vector<size_t> counted(size_t count, const Do& holds) {
    std::vector<size_t> before = in_blocks<size_t>(count, [&](size_t first, size_t last) {
        size_t result = 0;
        for (size_t i = first; i < last; ++i) result += holds(i);
        return result;
    });
    size_t total = 0;
    for (size_t& number : before) total += std::exchange(number, total);
    before.push_back(total);
    return before;
}

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
