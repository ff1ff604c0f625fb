// Three passes over the bricks, each brick by itself: signs, counts, then vertices and triangles at the places that the
// sums of the counts give. Empty cells cost nothing: a word holds 64 of them.
#include "marching_cubes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "cases.h"
#include "signs.h"

// Ranks of vertices are bit counts, which the baseline x86-64 has no instruction for: MULTI_POPCNT lets the loader choose.
#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__) && !defined(__clang__)
#define MULTI_POPCNT __attribute__((target_clones("popcnt", "default")))
#else
#define MULTI_POPCNT
#endif

namespace fracslice {
namespace {

// Where a brick's crossings are numbered: by axis, then by x, then by bit.
struct Crossings {
    std::array<std::array<Slab, kSide>, 3> bits;
    std::array<std::array<uint16_t, kSide>, 3> rank;  // crossings of this brick before that slab
    uint32_t base;                                    // vertices before this brick
};

struct Cells {
    std::array<int, 3> place;  // of the brick that holds the cells, in bricks
    size_t triangles;          // a count, then how many lie before
};

struct Edge {
    uint8_t axis, dx, dy, dz;
};

constexpr std::array<Edge, 12> make_edges() {
    std::array<Edge, 12> edges{};
    for (uint8_t e = 0; e < 12; ++e) {
        uint8_t axis = e / 4, p = e & 1, q = e >> 1 & 1;
        edges[e] = axis == 0 ? Edge{0, 0, p, q} : axis == 1 ? Edge{1, p, 0, q} : Edge{2, p, q, 0};
    }
    return edges;
}
constexpr std::array<Edge, 12> kEdges = make_edges();

// A bit for each cell between two slabs of corners whose corners are not all alike.
Slab mixed(const Corners& a, const Corners& b) {
    Slab any = a[0] | a[1] | a[2] | a[3] | b[0] | b[1] | b[2] | b[3];
    Slab all = a[0] & a[1] & a[2] & a[3] & b[0] & b[1] & b[2] & b[3];
    return any & ~all;
}

// The cases of eight cells along z, one in each byte: the transpose of their eight corner bits.
Slab cases_of_row(const Corners& a, const Corners& b, int y) {
    Slab m = 0;
    for (int k = 0; k < 4; ++k) {
        m |= (a[k] >> 8 * y & 0xff) << 16 * k | (b[k] >> 8 * y & 0xff) << (16 * k + 8);
    }
    Slab t = (m ^ m >> 7) & 0x00aa00aa00aa00aau;
    m ^= t ^ t << 7;
    t = (m ^ m >> 14) & 0x0000cccc0000ccccu;
    m ^= t ^ t << 14;
    t = (m ^ m >> 28) & 0x00000000f0f0f0f0u;
    return m ^ t ^ t << 28;
}

// Calls visit(x, y, z, case) for every cell of a brick that the surface passes, in that order.
template <class Visit>
inline void for_each_cell(const std::array<Corners, kSide + 1>& corners, const Visit& visit) {
    for (int x = 0; x < kSide; ++x) {
        const Corners &a = corners[x], &b = corners[x + 1];
        Slab cells = mixed(a, b);
        while (cells) {
            int y = __builtin_ctzll(cells) / 8;
            Slab cases = cases_of_row(a, b, y);
            for (unsigned row = cells >> 8 * y & 0xff; row; row &= row - 1) {
                int z = __builtin_ctz(row);
                visit(x, y, z, uint8_t(cases >> 8 * z));
            }
            cells &= y == 7 ? 0 : ~Slab(0) << 8 * (y + 1);
        }
    }
}

size_t count_triangles(const std::array<Corners, kSide + 1>& corners) {
    size_t total = 0;
    for_each_cell(corners, [&](int, int, int, uint8_t c) { total += kCases[c].triangles; });
    return total;
}

// Finds a brick's crossings and returns their number.
MULTI_POPCNT uint32_t find_crossings(const std::array<Corners, kSide + 1>& corners, Crossings& found) {
    for (int x = 0; x < kSide; ++x) {
        const Corners& own = corners[x];
        found.bits[0][x] = own[0] ^ corners[x + 1][0];
        found.bits[1][x] = own[0] ^ own[1];
        found.bits[2][x] = own[0] ^ own[2];
    }
    uint32_t total = 0;
    for (int axis = 0; axis < 3; ++axis) {
        for (int x = 0; x < kSide; ++x) {
            found.rank[axis][x] = uint16_t(total);
            total += uint32_t(__builtin_popcountll(found.bits[axis][x]));
        }
    }
    return total;
}

// The bricks without samples whose cells the surface passes: those that see a sampled brick across an edge or a corner
// with another sign there. Their places, in order.
std::vector<std::array<int, 3>> ghosts(const Bricks& bricks, const std::vector<Signs>& signs) {
    std::vector<std::array<int, 3>> found;
    for (size_t row = 0; row < bricks.count; ++row) {
        const int32_t* p = bricks.ijk + 3 * row;
        for (int k : {3, 5, 6, 7}) {
            std::array<int, 3> q = {p[0] / kSide - (k & 1), p[1] / kSide - (k >> 1 & 1), p[2] / kSide - (k >> 2 & 1)};
            int32_t at = bricks.at(q[0], q[1], q[2]);
            if (at >= 0) continue;
            Slab seen = (k & 2 ? 0xff : ~Slab(0)) & (k & 4 ? 0x0101010101010101u : ~Slab(0)), differ = 0;
            for (int x = 0; x < (k & 1 ? 1 : kSide); ++x) differ |= (signs[row][x] ^ constant(at)) & seen;
            if (differ) found.push_back(q);
        }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

// Replaces each count by the sum of those before it; returns the whole sum.
template <class Items, class Member>
size_t running_sum(Items& items, Member member, const char* what) {
    size_t total = 0;
    for (auto& item : items) {
        size_t count = item.*member;
        item.*member = total;
        total += count;
    }
    if (total > size_t(std::numeric_limits<int32_t>::max())) {
        throw std::length_error("the surface has " + std::to_string(total) + " " + what + ", more than 2^31");
    }
    return total;
}

class Extraction {
  public:
    Extraction(const Bricks& bricks, const Placement& placement)
        : bricks_(bricks), placement_(placement), signs_(signs_of(bricks)), crossings_(bricks.count) {
        if (int64_t open = open_edges(bricks, signs_)) {
            throw std::invalid_argument("not closed: " + std::to_string(open) + " sign changes leave the samples");
        }
        cells_.resize(bricks.count);
        for (size_t row = 0; row < bricks.count; ++row) {
            for (int k = 0; k < 3; ++k) cells_[row].place[k] = bricks.ijk[3 * row + k] / kSide;
        }
        for (const auto& place : ghosts(bricks, signs_)) cells_.push_back({place, 0});
    }

    Surface run() {
        tbb::parallel_for(size_t(0), cells_.size(), [&](size_t i) { count(i); });
        size_t vertices = running_sum(crossings_, &Crossings::base, "vertices");
        size_t triangles = running_sum(cells_, &Cells::triangles, "triangles");
        surface_.vertices = {vertices, 3};
        surface_.lower = {vertices, 3};
        surface_.axis = {vertices, 1};
        surface_.triangles = {triangles, 3};
        tbb::parallel_for(size_t(0), cells_.size(), [&](size_t i) {
            if (i < bricks_.count) write_vertices(i);
            write_triangles(i);
        });
        return std::move(surface_);
    }

  private:
    Octant octant(size_t i) const {
        const auto& p = cells_[i].place;
        return {bricks_, p[0], p[1], p[2]};
    }

    void count(size_t i) {
        auto corners = corners_of(octant(i), signs_);
        if (i < bricks_.count) crossings_[i].base = find_crossings(corners, crossings_[i]);
        cells_[i].triangles = count_triangles(corners);
    }

    void write_vertices(size_t row) {
        const Crossings& own = crossings_[row];
        Octant near = octant(row);
        size_t vertex = own.base;
        for (int axis = 0; axis < 3; ++axis) {
            for (int x = 0; x < kSide; ++x) {
                for (Slab bits = own.bits[axis][x]; bits; bits &= bits - 1) {
                    int bit = __builtin_ctzll(bits);
                    write_vertex(vertex++, row, near, axis, {x, bit / 8, bit % 8});
                }
            }
        }
    }

    void write_vertex(size_t vertex, size_t row, const Octant& near, int axis, std::array<int, 3> p) {
        auto next = p;
        bool leaves = ++next[axis] == kSide;
        if (leaves) next[axis] = 0;
        double a = value(row, p), b = value(leaves ? size_t(near.rows[1 << axis]) : row, next);
        double t = a / (a - b), low = placement_.clamp, high = 1 - low;
        t = t > low ? (t < high ? t : high) : low;
        for (int k = 0; k < 3; ++k) {
            int32_t grid = bricks_.ijk[3 * row + k] + p[k];
            surface_.lower.data[3 * vertex + k] = grid;
            surface_.vertices.data[3 * vertex + k] = placement_.origin[k] + placement_.voxel * (grid + (k == axis ? t : 0));
        }
        surface_.axis.data[vertex] = uint8_t(axis);
    }

    float value(size_t row, const std::array<int, 3>& p) const {
        return bricks_.values[row * kSamples + size_t(p[0] * 64 + p[1] * 8 + p[2])];
    }

    MULTI_POPCNT void write_triangles(size_t i);

    Bricks bricks_;
    Placement placement_;
    std::vector<Signs> signs_;
    std::vector<Crossings> crossings_;
    std::vector<Cells> cells_;  // the bricks, then the ghosts
    Surface surface_;
};

void Extraction::write_triangles(size_t i) {
    Octant near = octant(i);
    int32_t* out = surface_.triangles.data.get() + 3 * cells_[i].triangles;
    for_each_cell(corners_of(near, signs_), [&](int x, int y, int z, uint8_t number) {
        const Case& cell = kCases[number];
        uint32_t vertex[12];
        for (unsigned edges = cell.edges; edges; edges &= edges - 1) {
            int e = __builtin_ctz(edges);
            const Edge& edge = kEdges[e];
            int ex = x + edge.dx, ey = y + edge.dy, ez = z + edge.dz;
            const Crossings& owner = crossings_[size_t(near.rows[ex / 8 + ey / 8 * 2 + ez / 8 * 4])];
            Slab before = (Slab(1) << (ey % 8 * 8 + ez % 8)) - 1;
            vertex[e] = owner.base + owner.rank[edge.axis][ex % 8] +
                        uint32_t(__builtin_popcountll(owner.bits[edge.axis][ex % 8] & before));
        }
        for (int k = 0; k < 3 * cell.triangles; ++k) *out++ = int32_t(vertex[cell.corners[k]]);
    });
}

}  // namespace

Surface marching_cubes(const Bricks& bricks, const Placement& placement) {
    check(bricks);
    return Extraction(bricks, placement).run();
}

}  // namespace fracslice
