#include "cells.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace fracslice {
namespace {

// Finds a brick's crossings and returns their number.
size_t find_crossings(const std::array<Corners, kSide + 1>& corners, Crossings& found) {
    for (int x = 0; x < kSide; ++x) {
        const Corners& own = corners[x];
        found.bits[0][x] = own[0] ^ corners[x + 1][0];
        found.bits[1][x] = own[0] ^ own[1];
        found.bits[2][x] = own[0] ^ own[2];
    }
    size_t total = 0;
    for (int axis = 0; axis < 3; ++axis) {
        for (int x = 0; x < kSide; ++x) {
            found.rank[axis][x] = uint16_t(total);
            total += size_t(popcount(found.bits[axis][x]));
        }
    }
    return total;
}

// The ghosts' places, in order.
std::vector<Place> ghosts(const Layout& layout, const std::vector<Signs>& signs) {
    std::vector<Place> found;
    for (size_t row = 0; row < layout.count; ++row) {
        const int32_t* p = layout.ijk + 3 * row;
        for (int k : {3, 5, 6, 7}) {
            Place q = {p[0] / kSide - (k & 1), p[1] / kSide - (k >> 1 & 1), p[2] / kSide - (k >> 2 & 1)};
            int32_t at = layout.at(q[0], q[1], q[2]);
            if (at >= 0) continue;
            Slab seen = (k & 2 ? kFirstY : ~Slab(0)) & (k & 4 ? kFirstZ : ~Slab(0)), differ = 0;
            for (int x = 0; x < (k & 1 ? 1 : kSide); ++x) differ |= (signs[row][x] ^ constant(at)) & seen;
            if (differ) found.push_back(q);
        }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

}  // namespace

CellGrid::CellGrid(const Layout& layout, std::vector<Signs> signs)
    : layout_(layout), signs_(std::move(signs)), crossings_(layout.count) {
    check(layout);
    if (int64_t open = open_edges(layout, signs_)) {
        throw std::invalid_argument("not closed: " + std::to_string(open) + " sign changes leave the samples");
    }
    places_.resize(layout.count);
    for (size_t row = 0; row < layout.count; ++row) {
        for (int k = 0; k < 3; ++k) places_[row][k] = layout.ijk[3 * row + k] / kSide;
    }
    if (!std::is_sorted(places_.begin(), places_.end())) throw std::invalid_argument("the bricks are not in order");
    tbb::parallel_for(size_t(0), layout.count, [&](size_t i) {
        crossings_[i].base = find_crossings(corners_of(octant(i), signs_), crossings_[i]);
    });
    vertices_ = running_sum(crossings_, &Crossings::base, "vertices");
    for (const Place& place : ghosts(layout, signs_)) places_.push_back(place);
}

void CellGrid::segments(size_t begin, size_t end, const std::array<double, 3>& origin, double voxel, size_t stride,
                        double* rows) const {
    auto after = [](size_t number, const Crossings& brick) { return number < brick.base; };
    size_t row = size_t(std::upper_bound(crossings_.begin(), crossings_.end(), begin, after) - crossings_.begin());
    for (row = row ? row - 1 : 0; row < sampled() && crossings_[row].base < end; ++row) {
        const int32_t* p = layout_.ijk + 3 * row;
        auto starts = ranges(row);
        for (int axis = 0; axis < 3; ++axis) {
            size_t first = std::max(starts[axis], begin), last = std::min(starts[axis + 1], end);
            if (first >= last) continue;
            for (int k = 0; k < 3; ++k) {
                double* to = rows + size_t(k + 3) * stride - begin;
                std::fill(to + first, to + last, k == axis ? voxel : 0);
            }
            size_t number = starts[axis];
            for (int x = 0; x < kSide; ++x) {
                double px = origin[0] + voxel * (p[0] + x);
                for (Slab bits = crossings_[row].bits[axis][x]; bits; bits &= bits - 1, ++number) {
                    if (number < first || number >= last) continue;
                    int bit = __builtin_ctzll(bits);
                    double* to = rows + (number - begin);
                    to[0] = px;
                    to[stride] = origin[1] + voxel * (p[1] + bit / 8);
                    to[2 * stride] = origin[2] + voxel * (p[2] + bit % 8);
                }
            }
        }
    }
}

void CellGrid::collect(const Octant& near, Numbers& numbers) const {
    for_each_near(near, [&](size_t place, uint32_t vertex) { numbers[place] = vertex; });
}

// The first brick of a sorted range whose layer is not before this one.
size_t CellGrid::lower_bound(size_t begin, size_t end, int layer) const {
    auto before = [](const Place& place, int wanted) { return place[0] < wanted; };
    return size_t(std::lower_bound(places_.begin() + int64_t(begin), places_.begin() + int64_t(end), layer, before) -
                  places_.begin());
}

Span CellGrid::span(Layers layers) const {
    size_t row = lower_bound(0, sampled(), layers.first), end = lower_bound(0, sampled(), layers.last);
    size_t ghost = lower_bound(sampled(), size(), layers.first), ghost_end = lower_bound(sampled(), size(), layers.last);
    return {row, end - row, ghost, ghost_end - ghost};
}

size_t CellGrid::crossings_before(int layer) const {
    size_t row = lower_bound(0, sampled(), layer);
    return row < sampled() ? crossings_[row].base : vertices_;
}

int64_t CellGrid::find(const Place& place) const {
    int32_t row = layout_.at(place[0], place[1], place[2]);
    if (row >= 0) return row;
    auto first = places_.begin() + int64_t(sampled()), found = std::lower_bound(first, places_.end(), place);
    return found != places_.end() && *found == place ? found - places_.begin() : -1;
}

}  // namespace fracslice
