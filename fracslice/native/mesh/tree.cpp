#include "tree.h"

#include <tbb/parallel_for.h>

#include <array>
#include <limits>
#include <utility>
#include <vector>

namespace fracslice {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Puts two empty bits between the 21 bits of x.
uint64_t spread(uint64_t x) {
    x &= 0x1FFFFF;
    x = (x | x << 32) & 0x1F00000000FFFF;
    x = (x | x << 16) & 0x1F0000FF0000FF;
    x = (x | x << 8) & 0x100F00F00F00F00F;
    x = (x | x << 4) & 0x10C30C30C30C30C3;
    return (x | x << 2) & 0x1249249249249249;
}

// The place of each triangle's middle on Morton's curve, in a grid of 2^21 cells along the longest side.
Array<uint64_t> morton_codes(const MeshView& mesh) {
    std::array<double, 3> low = {kInfinity, kInfinity, kInfinity}, high = {-kInfinity, -kInfinity, -kInfinity};
    for (size_t i = 0; i < 3 * mesh.vertices; ++i) {
        low[i % 3] = std::min(low[i % 3], mesh.positions[i]);
        high[i % 3] = std::max(high[i % 3], mesh.positions[i]);
    }
    double size = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    double scale = size > 0 ? 0x1FFFFF / size : 0;
    Array<uint64_t> codes(mesh.count, 1);
    tbb::parallel_for(size_t(0), mesh.count, [&](size_t t) {
        uint64_t code = 0;
        for (int k = 0; k < 3; ++k) {
            double middle = (mesh.corner(t, 0)[k] + mesh.corner(t, 1)[k] + mesh.corner(t, 2)[k]) / 3;
            code |= spread(uint64_t(std::max(0.0, (middle - low[k]) * scale))) << k;
        }
        codes.data[t] = code;
    });
    return codes;
}

// The indices of the codes from the lowest on, equal ones in their order: sorted by digits, the last first.
Array<uint32_t> sorted(Array<uint64_t> codes) {
    constexpr int bits = 11, digits = 6;
    constexpr size_t values = size_t(1) << bits;
    size_t n = codes.rows;
    std::vector<std::array<size_t, values>> before(digits);
    auto digit = [](uint64_t code, int d) { return code >> (bits * d) & (values - 1); };
    for (size_t i = 0; i < n; ++i) {
        for (int d = 0; d < digits; ++d) ++before[d][digit(codes.data[i], d)];
    }
    Array<uint64_t> next_codes(n, 1);
    Array<uint32_t> order(n, 1), next_order(n, 1);
    for (size_t i = 0; i < n; ++i) order.data[i] = uint32_t(i);
    for (int d = 0; d < digits; ++d) {
        size_t total = 0;
        for (size_t& count : before[d]) total += std::exchange(count, total);
        for (size_t i = 0; i < n; ++i) {
            size_t place = before[d][digit(codes.data[i], d)]++;
            next_codes.data[place] = codes.data[i];
            next_order.data[place] = order.data[i];
        }
        std::swap(codes, next_codes);
        std::swap(order, next_order);
    }
    return order;
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

Tree build_tree(const MeshView& mesh) {
    Tree tree;
    Array<uint32_t> order = sorted(morton_codes(mesh));
    tree.order = {mesh.count, 1};
    std::copy_n(order.data.get(), mesh.count, tree.order.data.get());
    size_t leaves = 1;
    while (leaves * kLeaf < mesh.count) leaves *= 2;
    tree.low = {2 * leaves, 3}, tree.high = {2 * leaves, 3};
    double *low = tree.low.data.get(), *high = tree.high.data.get();
    set_leaf(mesh, nullptr, nullptr, low, high);  // node 0, which is none
    tbb::parallel_for(size_t(0), leaves, [&](size_t leaf) {
        const int64_t* all = tree.order.data.get();
        size_t first = std::min(leaf * kLeaf, mesh.count), last = std::min(first + kLeaf, mesh.count);
        set_leaf(mesh, all + first, all + last, low + 3 * (leaves + leaf), high + 3 * (leaves + leaf));
    });
    for (size_t i = 3 * leaves; i-- > 3;) {
        size_t child = 6 * (i / 3) + i % 3;
        low[i] = std::min(low[child], low[child + 3]);
        high[i] = std::max(high[child], high[child + 3]);
    }
    return tree;
}

}  // namespace fracslice
