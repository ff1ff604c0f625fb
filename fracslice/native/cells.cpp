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
            total += size_t(__builtin_popcountll(found.bits[axis][x]));
        }
    }
    return total;
}

// The ghosts' places, in order.
std::vector<Place> ghosts(const Bricks& bricks, const std::vector<Signs>& signs) {
    std::vector<Place> found;
    for (size_t row = 0; row < bricks.count; ++row) {
        const int32_t* p = bricks.ijk + 3 * row;
        for (int k : {3, 5, 6, 7}) {
            Place q = {p[0] / kSide - (k & 1), p[1] / kSide - (k >> 1 & 1), p[2] / kSide - (k >> 2 & 1)};
            int32_t at = bricks.at(q[0], q[1], q[2]);
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

// Rounds towards minus infinity.
int brick_of(int x) { return x >= 0 ? x / kSide : -((kSide - 1 - x) / kSide); }

}  // namespace

CellGrid::CellGrid(const Bricks& bricks) : bricks_(bricks), signs_(signs_of(bricks)), crossings_(bricks.count) {
    if (int64_t open = open_edges(bricks, signs_)) {
        throw std::invalid_argument("not closed: " + std::to_string(open) + " sign changes leave the samples");
    }
    places_.resize(bricks.count);
    for (size_t row = 0; row < bricks.count; ++row) {
        for (int k = 0; k < 3; ++k) places_[row][k] = bricks.ijk[3 * row + k] / kSide;
    }
    tbb::parallel_for(size_t(0), bricks.count, [&](size_t i) {
        crossings_[i].base = find_crossings(corners_of(octant(i), signs_), crossings_[i]);
    });
    vertices_ = running_sum(crossings_, &Crossings::base, "vertices");
    for (const Place& place : ghosts(bricks, signs_)) places_.push_back(place);
}

int64_t CellGrid::find(const Place& place, int x, int y, int z) const {
    Place wanted = {place[0] + brick_of(x), place[1] + brick_of(y), place[2] + brick_of(z)};
    int32_t row = bricks_.at(wanted[0], wanted[1], wanted[2]);
    if (row >= 0) return row;
    auto first = places_.begin() + int64_t(bricks_.count), found = std::lower_bound(first, places_.end(), wanted);
    return found != places_.end() && *found == wanted ? found - places_.begin() : -1;
}

}  // namespace fracslice
