#include "tree.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <array>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "blocks.h"
#include "quantise.h"

namespace fracslice::mesh {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Bits of a place along an axis, and of a triangle's number: a key holds three and one of these.
constexpr int kPlaceBits = 11, kNumberBits = 31;

// Puts two empty bits between the bits of x.
uint64_t spread(uint64_t x) {
    x = (x | x << 16) & 0xFF0000FF;
    x = (x | x << 8) & 0xF00F00F00F;
    x = (x | x << 4) & 0xC30C30C30C3;
    return (x | x << 2) & 0x249249249249;
}

// The place of each triangle's middle on Morton's curve, in a grid of 2^11 cells along the longest side, before its number.
Array<uint64_t> keys(const MeshView& mesh) {
    constexpr double most = (1 << kPlaceBits) - 1;
    Bounds box = bounds({mesh.positions, 3 * mesh.vertices});
    double size = 0;
    for (int k = 0; k < 3; ++k) size = std::max(size, box.high[k] - box.low[k]);
    double scale = size > 0 ? most / size : 0;
    Array<uint64_t> keys(mesh.count, 1);
    tbb::parallel_for(size_t(0), mesh.count, [&](size_t t) {
        uint64_t code = 0;
        for (int k = 0; k < 3; ++k) {
            double middle = (mesh.corner(t, 0)[k] + mesh.corner(t, 1)[k] + mesh.corner(t, 2)[k]) / 3;
            code |= spread(uint64_t(std::clamp((middle - box.low[k]) * scale, 0.0, most))) << k;
        }
        keys.data[t] = code << kNumberBits | t;
    });
    return keys;
}

// The keys in the order of their places, then of their numbers: sorted by digits, the last first. Each block knows where its keys
// with a digit go.
Array<uint64_t> sorted(Array<uint64_t> keys) {
    constexpr int bits = 11, digits = 3 * kPlaceBits / bits;
    constexpr size_t values = size_t(1) << bits, parts = 64;
    size_t n = keys.rows, size = (n + parts - 1) / parts;
    Array<uint64_t> next(n, 1);
    std::vector<std::array<size_t, values>> before(parts);
    for (int d = 0; d < digits; ++d) {
        auto for_each = [&](size_t part, const auto& act) {
            for (size_t i = std::min(n, part * size), last = std::min(n, i + size); i < last; ++i) {
                act(keys.data[i], before[part][keys.data[i] >> (kNumberBits + bits * d) & (values - 1)]);
            }
        };
        tbb::parallel_for(size_t(0), parts, [&](size_t part) {
            before[part].fill(0);
            for_each(part, [](uint64_t, size_t& count) { ++count; });
        });
        size_t total = 0;
        for (size_t value = 0; value < values; ++value) {
            for (auto& part : before) total += std::exchange(part[value], total);
        }
        tbb::parallel_for(size_t(0), parts, [&](size_t part) {
            for_each(part, [&](uint64_t key, size_t& place) { next.data[place++] = key; });
        });
        std::swap(keys, next);
    }
    return keys;
}

using Middle = std::array<float, 3>;

// Cuts a run of triangles in two across the longest side of the box of their middles, and each part again, down to leaves.
void halve(const std::vector<Middle>& middles, int64_t* first, int64_t* last, size_t leaves) {
    if (size_t(last - first) <= kLeaf) return;
    leaves /= 2;
    int64_t* half = std::min(first + leaves * kLeaf, last);  // whole leaves, and empty ones at the end
    if (half < last) {
        Middle low = middles[size_t(*first)], high = low;
        for (const int64_t* t = first; t < last; ++t) {
            const Middle& middle = middles[size_t(*t)];
            for (size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], middle[k]), high[k] = std::max(high[k], middle[k]);
        }
        size_t axis = 0;
        for (size_t k = 1; k < 3; ++k) axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
        std::nth_element(first, half, last, [&](int64_t a, int64_t b) {
            return std::pair(middles[size_t(a)][axis], a) < std::pair(middles[size_t(b)][axis], b);
        });
    }
    tbb::parallel_invoke([&] { halve(middles, first, half, leaves); }, [&] { halve(middles, half, last, leaves); });
}

Array<int64_t> in_morton_order(const MeshView& mesh) {
    Array<uint64_t> order = sorted(keys(mesh));
    Array<int64_t> result(mesh.count, 1);
    for_each_number(mesh.count, [&](size_t i) { result.data[i] = int64_t(order.data[i] & ((uint64_t(1) << kNumberBits) - 1)); });
    return result;
}

Array<int64_t> in_halves(const MeshView& mesh, size_t leaves) {
    std::vector<Middle> middles(mesh.count);
    Array<int64_t> result(mesh.count, 1);
    for_each_number(mesh.count, [&](size_t t) {
        result.data[t] = int64_t(t);
        for (size_t k = 0; k < 3; ++k) middles[t][k] = float((mesh.corner(t, 0)[k] + mesh.corner(t, 1)[k] + mesh.corner(t, 2)[k]) / 3);
    });
    halve(middles, result.data.get(), result.data.get() + mesh.count, leaves);
    return result;
}

void set_leaf(const MeshView& mesh, const int64_t* first, const int64_t* last, double* low, double* high) {
    std::fill_n(low, 3, kInfinity);
    std::fill_n(high, 3, -kInfinity);
    for (; first < last; ++first) {
        for (int corner = 0; corner < 3; ++corner) {
            const double* p = mesh.corner(size_t(*first), corner);
            for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
        }
    }
}

}  // namespace

Tree build_tree(const MeshView& mesh, bool halved) {
    Tree tree;
    if (mesh.count >> kNumberBits) throw std::invalid_argument("more than 2^31 triangles");
    size_t leaves = 1;
    while (leaves * kLeaf < mesh.count) leaves *= 2;
    tree.order = halved ? in_halves(mesh, leaves) : in_morton_order(mesh);
    tree.low = {2 * leaves, 3}, tree.high = {2 * leaves, 3};
    double *low = tree.low.data.get(), *high = tree.high.data.get();
    set_leaf(mesh, nullptr, nullptr, low, high);  // node 0, which is none
    tbb::parallel_for(size_t(0), leaves, [&](size_t leaf) {
        const int64_t* all = tree.order.data.get();
        size_t first = std::min(leaf * kLeaf, mesh.count), last = std::min(first + kLeaf, mesh.count);
        set_leaf(mesh, all + first, all + last, low + 3 * (leaves + leaf), high + 3 * (leaves + leaf));
    });
    for (size_t level = leaves / 2; level > 0; level /= 2) {
        for_each_block(level, [&](size_t, size_t first, size_t last) {
            for (size_t i = 3 * (level + first); i < 3 * (level + last); ++i) {
                size_t child = 6 * (i / 3) + i % 3;
                low[i] = std::min(low[child], low[child + 3]);
                high[i] = std::max(high[child], high[child + 3]);
            }
        });
    }
    return tree;
}

}  // namespace fracslice::mesh
