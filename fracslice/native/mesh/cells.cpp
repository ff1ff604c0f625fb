#include "cells.h"

#include <algorithm>
#include <bit>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "triangles.h"

namespace fracslice::mesh {
namespace {

constexpr uint32_t kNobody = std::numeric_limits<uint32_t>::max();

// Finds a brick's crossings and returns their number.
size_t find_crossings(const std::array<CornerPlanes, kSide + 1>& corners, BrickCrossings& result) {
    for (int x = 0; x < kSide; ++x) {
        const CornerPlanes& own = corners[x];
        result.bits[0][x] = own[0] ^ corners[x + 1][0];
        result.bits[1][x] = own[0] ^ own[1];
        result.bits[2][x] = own[0] ^ own[2];
    }
    size_t total = 0;
    for (int axis = 0; axis < 3; ++axis) {
        for (int x = 0; x < kSide; ++x) {
            result.rank[axis][x] = uint16_t(total);
            total += size_t(std::popcount(result.bits[axis][x]));
        }
    }
    return total;
}

// The ghosts' places, in order.
std::vector<BrickPlace> ghosts(const Layout& layout, const std::vector<Signs>& signs) {
    auto result = joined(in_blocks<std::vector<BrickPlace>>(layout.count, [&](size_t begin, size_t end) {
        std::vector<BrickPlace> seen_here;
        for (size_t row = begin; row < end; ++row) {
            const int32_t* p = layout.ijk + 3 * row;
            for (int k : {3, 5, 6, 7}) {
                BrickPlace q = {p[0] / kSide - (k & 1), p[1] / kSide - (k >> 1 & 1), p[2] / kSide - (k >> 2 & 1)};
                int32_t at = layout.at(q[0], q[1], q[2]);
                if (at >= 0) continue;
                BitPlane seen = (k & 2 ? kFirstY : ~BitPlane(0)) & (k & 4 ? kFirstZ : ~BitPlane(0)), differ = 0;
                for (int x = 0; x < (k & 1 ? 1 : kSide); ++x) differ |= (signs[row][x] ^ constant(at)) & seen;
                if (differ) seen_here.push_back(q);
            }
        }
        return seen_here;
    }));
    tbb::parallel_sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
}

}  // namespace

CellGrid::CellGrid(const Layout& layout, std::vector<Signs> signs)
    : layout_(layout), signs_(std::move(signs)), crossings_(layout.count) {
    volume::check(layout);
    if (int64_t open = volume::open_edges(layout, signs_)) {
        throw std::invalid_argument("not closed: " + std::to_string(open) + " sign changes leave the samples");
    }
    places_.resize(layout.count);
    for_each_block(layout.count, [&](size_t, size_t begin, size_t end) {
        for (size_t row = begin; row < end; ++row) {
            for (size_t k = 0; k < 3; ++k) places_[row][k] = layout.ijk[3 * row + k] / kSide;
        }
    });
    if (!std::is_sorted(places_.begin(), places_.end())) throw std::invalid_argument("the bricks are not in order");
    tbb::parallel_for(size_t(0), layout.count, [&](size_t i) {
        crossings_[i].base = find_crossings(corners_of(octant(i), signs_), crossings_[i]);
    });
    vertices_ = running_sum(crossings_, &BrickCrossings::base, "vertices");
    for (const BrickPlace& place : ghosts(layout, signs_)) places_.push_back(place);
}

size_t CellGrid::brick_of(size_t crossing) const {
    auto after = [](size_t number, const BrickCrossings& brick) { return number < brick.base; };
    size_t row = size_t(std::upper_bound(crossings_.begin(), crossings_.end(), crossing, after) - crossings_.begin());
    return row ? row - 1 : 0;
}

size_t CellGrid::end_of_brick(size_t crossing) const { return ranges(brick_of(crossing))[3]; }

void CellGrid::lay(size_t begin, size_t end, const std::array<double, 3>& origin, double voxel, GridEdges& edges) const {
    for (auto& row : edges.starts) row.resize(end - begin);
    edges.led.resize(end - begin);
    edges.leaders.clear();
    edges.bricks.clear();
    for (size_t row = brick_of(begin); row < sampled() && crossings_[row].base < end; ++row) {
        std::array<std::array<double, kSide>, 3> grid;
        for (size_t k = 0; k < 3; ++k) {
            for (int x = 0; x < kSide; ++x) grid[k][size_t(x)] = origin[k] + voxel * (layout_.ijk[3 * row + k] + x);
        }
        size_t number = crossings_[row].base;
        edges.bricks.push_back({uint32_t(std::max(number, begin) - begin), uint32_t(edges.leaders.size())});
        for (uint8_t axis = 0; axis < 3; ++axis) {
            std::array<uint32_t, kSide> leading;  // by plane
            leading.fill(kNobody);
            for (size_t x = 0; x < kSide; ++x) {
                for (BitPlane bits = crossings_[row].bits[axis][x]; bits; bits &= bits - 1, ++number) {
                    if (number < begin || number >= end) continue;
                    size_t bit = size_t(std::countr_zero(bits)), at[] = {x, bit / 8, bit % 8}, edge = number - begin;
                    for (size_t k = 0; k < 3; ++k) edges.starts[k][edge] = grid[k][at[k]];
                    uint32_t& leader = leading[at[axis]];
                    if (leader == kNobody) {
                        leader = uint32_t(edges.leaders.size());
                        edges.leaders.push_back({uint32_t(edge), axis});
                    }
                    edges.led[edge] = leader;
                }
            }
        }
    }
    edges.bricks.push_back({uint32_t(end - begin), uint32_t(edges.leaders.size())});
}

void CellGrid::edges(size_t begin, size_t end, int16_t* rows) const {
    if (begin == end) return;
    tbb::parallel_for(brick_of(begin), brick_of(end - 1) + 1, [&](size_t row) {
        for_each_own_edge(row, [&](const CellEdge& edge) {
            if (edge.vertex < begin || edge.vertex >= end) return;
            int16_t* to = std::transform(edge.lower.begin(), edge.lower.end(), rows + 4 * (edge.vertex - begin),
                                         [](int32_t k) { return int16_t(k); });
            *to = edge.axis;
        });
    });
}

void CellGrid::collect(const Octant& near, Numbers& numbers) const {
    for_each_near(near, [&](size_t place, uint32_t vertex) { numbers[place] = vertex; });
}

// The first brick of a sorted range whose layer is not before this one.
size_t CellGrid::lower_bound(size_t begin, size_t end, int layer) const {
    auto before = [](const BrickPlace& place, int wanted) { return place[0] < wanted; };
    return size_t(std::lower_bound(places_.begin() + int64_t(begin), places_.begin() + int64_t(end), layer, before) -
                  places_.begin());
}

LayerBricks CellGrid::bricks_of(Layers layers) const {
    size_t row = lower_bound(0, sampled(), layers.first), end = lower_bound(0, sampled(), layers.last);
    size_t ghost = lower_bound(sampled(), size(), layers.first), ghost_end = lower_bound(sampled(), size(), layers.last);
    return {row, end - row, ghost, ghost_end - ghost};
}

size_t CellGrid::crossings_before(int layer) const {
    size_t row = lower_bound(0, sampled(), layer);
    return row < sampled() ? crossings_[row].base : vertices_;
}

int64_t CellGrid::find(const BrickPlace& place) const {
    int32_t row = layout_.at(place[0], place[1], place[2]);
    if (row >= 0) return row;
    auto first = places_.begin() + int64_t(sampled()), result = std::lower_bound(first, places_.end(), place);
    return result != places_.end() && *result == place ? result - places_.begin() : -1;
}

}  // namespace fracslice::mesh
