#include "signs.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <bit>
#include <functional>
#include <stdexcept>
#include <string>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace fracslice::volume {
namespace {

constexpr BitPlane kLastY = kFirstY << 56, kLastZ = kFirstZ << 7;

BitPlane negative(const float* values) {
    BitPlane bits = 0;
#if defined(__SSE2__)
    const __m128 zero = _mm_setzero_ps();
    for (int k = 0; k < 64; k += 4) {
        bits |= BitPlane(_mm_movemask_ps(_mm_cmplt_ps(_mm_loadu_ps(values + k), zero))) << k;
    }
#else
    for (int k = 0; k < 64; ++k) bits |= BitPlane(values[k] < 0) << k;
#endif
    return bits;
}

// Sign changes between a brick's samples and the one sign of a neighbour that has none.
int64_t across(const Signs& s, int axis, bool high, BitPlane sign) {
    if (axis == 0) return std::popcount(s[high ? 7 : 0] ^ sign);
    BitPlane face = axis == 1 ? (high ? kLastY : kFirstY) : (high ? kLastZ : kFirstZ);
    int64_t total = 0;
    for (BitPlane plane : s) total += std::popcount((plane ^ sign) & face);
    return total;
}

int64_t open_edges_of_brick(const Layout& layout, const Signs& signs, size_t row) {
    int64_t total = 0;
    for (int axis = 0; axis < 3; ++axis) {
        for (int high = 0; high < 2; ++high) {
            std::array<int, 3> p;
            for (int k = 0; k < 3; ++k) p[k] = layout.ijk[3 * row + k] / kSide;
            p[axis] += high ? 1 : -1;
            int32_t at = layout.at(p[0], p[1], p[2]);
            if (at < 0) total += across(signs, axis, high, constant(at));
        }
    }
    return total;
}

// Faces between two bricks without samples, counted at the inside one: all beyond it is inside, or without closure.
int64_t open_faces(const Layout& layout, int x) {
    int64_t total = 0;
    for (int y = 0; y < layout.size[1]; ++y) {
        for (int z = 0; z < layout.size[2]; ++z) {
            if (layout.at(x, y, z) != kInside) continue;
            total += (layout.at(x - 1, y, z) == kOutside) + (layout.at(x + 1, y, z) == kOutside) +
                     (layout.at(x, y - 1, z) == kOutside) + (layout.at(x, y + 1, z) == kOutside) +
                     (layout.at(x, y, z - 1) == kOutside) + (layout.at(x, y, z + 1) == kOutside);
        }
    }
    return total;
}

template <class Count>
int64_t sum(size_t n, const Count& count) {
    return tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, n), int64_t(0),
        [&](const tbb::blocked_range<size_t>& range, int64_t total) {
            for (size_t i = range.begin(); i < range.end(); ++i) total += count(i);
            return total;
        },
        std::plus<int64_t>());
}

}  // namespace

void check(const Layout& layout) {
    size_t cells = size_t(layout.size[0]) * layout.size[1] * layout.size[2];
    if (sum(cells, [&](size_t k) { return layout.index[k] < kInside; })) {
        throw std::invalid_argument("index holds a number below -2");
    }
    if (size_t(sum(cells, [&](size_t k) { return layout.index[k] >= 0; })) != layout.count) {
        throw std::invalid_argument("index does not name every brick once");
    }
    auto misplaced = [&](size_t row) {
        const int32_t* p = layout.ijk + 3 * row;
        bool aligned = p[0] >= 0 && p[1] >= 0 && p[2] >= 0 && !((p[0] | p[1] | p[2]) % kSide);
        return !aligned || layout.at(p[0] / kSide, p[1] / kSide, p[2] / kSide) != int32_t(row);
    };
    if (!sum(layout.count, misplaced)) return;
    size_t row = 0;
    while (!misplaced(row)) ++row;
    throw std::invalid_argument("brick " + std::to_string(row) + " is not where index says");
}

std::vector<Signs> signs_of(const Bricks& bricks) {
    std::vector<Signs> signs(bricks.count);
    tbb::parallel_for(size_t(0), bricks.count, [&](size_t row) {
        for (int x = 0; x < kSide; ++x) signs[row][x] = negative(bricks.values + row * kSamples + x * 64);
    });
    return signs;
}

int64_t open_edges(const Layout& layout, const std::vector<Signs>& signs) {
    return sum(layout.count, [&](size_t row) { return open_edges_of_brick(layout, signs[row], row); }) +
           64 * sum(layout.size[0], [&](size_t x) { return open_faces(layout, int(x)); });
}

std::array<CornerPlanes, kSide + 1> corners_of(const Octant& octant, const std::vector<Signs>& signs) {
    std::array<CornerPlanes, kSide + 1> corners;
    for (int x = 0; x <= kSide; ++x) {
        CornerPlanes own;
        for (int k = 0; k < 4; ++k) {
            int32_t row = octant.rows[(x == kSide) + 2 * k];
            own[k] = row >= 0 ? signs[row][x % kSide] : constant(row);
        }
        BitPlane y = shift_y(own[0], own[1]);
        corners[x] = {own[0], y, shift_z(own[0], own[2]), shift_z(y, shift_y(own[2], own[3]))};
    }
    return corners;
}

}  // namespace fracslice::volume
