// The cells that the surface passes and the vertices on their edges, numbered.
#pragma once

#include <bit>
#include <limits>
#include <stdexcept>
#include <string>

#include "../volume/signs.h"
#include "cases.h"

namespace fracslice::mesh {

using volume::BitPlane, volume::CornerPlanes, volume::Layout, volume::Octant, volume::Signs;
using volume::constant, volume::corners_of, volume::kFirstY, volume::kFirstZ, volume::kSamples, volume::kSide, volume::shift_y, volume::shift_z;

using BrickPlace = std::array<int, 3>;  // of a brick, in bricks

constexpr size_t kMostElements = size_t(std::numeric_limits<int32_t>::max());

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

// Numbers of the vertices around a brick's cells: by axis, then by x, y, z of the lower end, 0 to 8.
constexpr int kReach = kSide + 1;
using Numbers = std::array<uint32_t, 3 * kReach * kReach * kReach>;

constexpr size_t number_at(int axis, int x, int y, int z) {
    return size_t(((axis * kReach + x) * kReach + y) * kReach + z);
}

// Where a brick's crossings are numbered: by axis, then by x, then by bit.
struct BrickCrossings {
    std::array<Signs, 3> bits;
    std::array<std::array<uint16_t, kSide>, 3> rank;  // crossings of this brick before that plane
    size_t base;                                      // vertices before this brick
};

// A grid edge that the surface crosses.
struct CellEdge {
    uint32_t vertex;
    uint8_t axis;
    std::array<int32_t, 3> lower;  // its lower grid point
};

// Grid edges side by side. A leader is the first of those of one brick whose ends are in the same two planes across them.
struct GridEdges {
    struct Leader {
        uint32_t edge;
        uint8_t axis;
    };
    struct Brick {
        uint32_t edge, leader;
    };
    std::array<std::vector<double>, 3> starts;  // where each starts, scene units
    std::vector<uint32_t> led;                  // by which leader
    std::vector<Leader> leaders;
    std::vector<Brick> bricks;  // the first edge and leader of each, and behind the last

    size_t axis(size_t edge) const { return leaders[led[edge]].axis; }
};

// A bit for each cell between two planes of corners whose corners are not all alike.
inline BitPlane mixed(const CornerPlanes& a, const CornerPlanes& b) {
    BitPlane any = a[0] | a[1] | a[2] | a[3] | b[0] | b[1] | b[2] | b[3];
    BitPlane all = a[0] & a[1] & a[2] & a[3] & b[0] & b[1] & b[2] & b[3];
    return any & ~all;
}

// The cases of eight cells along z, one in each byte: the transpose of their eight corner bits.
inline BitPlane cases_of_row(const CornerPlanes& a, const CornerPlanes& b, int y) {
    BitPlane m = 0;
    for (int k = 0; k < 4; ++k) {
        m |= (a[k] >> 8 * y & 0xff) << 16 * k | (b[k] >> 8 * y & 0xff) << (16 * k + 8);
    }
    BitPlane t = (m ^ m >> 7) & 0x00aa00aa00aa00aau;
    m ^= t ^ t << 7;
    t = (m ^ m >> 14) & 0x0000cccc0000ccccu;
    m ^= t ^ t << 14;
    t = (m ^ m >> 28) & 0x00000000f0f0f0f0u;
    return m ^ t ^ t << 28;
}

// Cells that the surface passes, between two planes of corners: by the one axis along which it crosses edges of theirs, all four
// in one direction, up where the lower end is outside; and the rest.
struct Passed {
    std::array<std::array<BitPlane, 2>, 3> flat;  // by axis and whether up
    BitPlane rest;

    Passed(const CornerPlanes& a, const CornerPlanes& b) {
        BitPlane axes[3] = {(a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2]) | (a[3] ^ b[3]),
                        (a[0] ^ a[1]) | (a[2] ^ a[3]) | (b[0] ^ b[1]) | (b[2] ^ b[3]),
                        (a[0] ^ a[2]) | (a[1] ^ a[3]) | (b[0] ^ b[2]) | (b[1] ^ b[3])};
        for (int axis = 0; axis < 3; ++axis) {
            BitPlane only = axes[axis] & ~(axes[(axis + 1) % 3] | axes[(axis + 2) % 3]);
            flat[axis] = {only & a[0], only & ~a[0]};
        }
        rest = (axes[0] & axes[1]) | (axes[1] & axes[2]) | (axes[2] & axes[0]);
    }

    int flat_count() const {
        BitPlane all = 0;
        for (const auto& both : flat) all |= both[0] | both[1];
        return std::popcount(all);
    }
};

// The cases of flat cells.
constexpr uint8_t kFlat[3][2] = {{0x55, 0xaa}, {0x33, 0xcc}, {0x0f, 0xf0}};

// Calls visit(x, y, z, case) for some cells between two planes of corners, in order.
template <class Visit>
inline void for_each_cell(const CornerPlanes& a, const CornerPlanes& b, int x, BitPlane cells, const Visit& visit) {
    while (cells) {
        int y = std::countr_zero(cells) / 8;
        BitPlane cases = cases_of_row(a, b, y);
        for (unsigned row = cells >> 8 * y & 0xff; row; row &= row - 1) {
            int z = std::countr_zero(row);
            visit(x, y, z, uint8_t(cases >> 8 * z));
        }
        cells &= y == 7 ? 0 : ~BitPlane(0) << 8 * (y + 1);
    }
}

// The same for every cell of a brick that the surface passes.
template <class Visit>
inline void for_each_cell(const std::array<CornerPlanes, kSide + 1>& corners, const Visit& visit) {
    for (int x = 0; x < kSide; ++x) for_each_cell(corners[x], corners[x + 1], x, mixed(corners[x], corners[x + 1]), visit);
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
    if (total > kMostElements) {
        throw std::length_error("the surface has " + std::to_string(total) + " " + what + ", more than 2^31");
    }
    return total;
}

// Bricks first, first + 1 ... last - 1 along x.
struct Layers {
    int first, last;
};

// The bricks of some layers: those with samples, then the ghosts.
struct LayerBricks {
    size_t row, rows, ghost, ghosts;

    size_t size() const { return rows + ghosts; }
    size_t brick(size_t k) const { return k < rows ? row + k : ghost + (k - rows); }
    size_t place_of(size_t brick) const { return brick < ghost ? brick - row : rows + (brick - ghost); }
};

// The bricks that hold cells which the surface passes: those with samples, in order, then the ghosts, without samples,
// which see a sampled brick across an edge or a corner with another sign there. Throws std::invalid_argument if layout and
// signs contradict each other or a sign change leaves the samples, std::length_error past 2^31 crossings.
class CellGrid {
  public:
    CellGrid(const Layout& layout, std::vector<Signs> signs);

    size_t size() const { return places_.size(); }
    size_t sampled() const { return layout_.count; }
    size_t vertices() const { return vertices_; }
    const Layout& layout() const { return layout_; }
    const std::vector<Signs>& signs() const { return signs_; }
    const BrickPlace& place(size_t i) const { return places_[i]; }
    Octant octant(size_t i) const { return {layout_, places_[i][0], places_[i][1], places_[i][2]}; }

    // Number of the brick at a place, -1 if the surface passes no cell of it.
    int64_t find(const BrickPlace& place) const;

    // Calls visit(place in Numbers, vertex) for a brick's own crossings, in order, then for those on its neighbours' near
    // sides that its cells have.
    template <class Visit>
    void for_each_near(const Octant& near, const Visit& visit) const {
        for (int k = 0; k < 8; ++k) {
            if (near.rows[k] < 0) continue;
            const BrickCrossings& owner = crossings_[size_t(near.rows[k])];
            BitPlane seen = (k & 2 ? kFirstY : ~BitPlane(0)) & (k & 4 ? kFirstZ : ~BitPlane(0));
            for (int axis = 0; axis < 3; ++axis) {
                if (k >> axis & 1) continue;
                for (int x = 0; x < (k & 1 ? 1 : kSide); ++x) {
                    size_t place = number_at(axis, x + (k & 1) * 8, (k & 2) * 4, (k & 4) * 2);
                    uint32_t first = uint32_t(owner.base) + owner.rank[axis][x], next = first;
                    BitPlane all = owner.bits[axis][x], bits = all & seen;
                    bool whole = bits == all;
                    for (; bits; bits &= bits - 1) {
                        int bit = std::countr_zero(bits);
                        uint32_t vertex = whole ? next++ : first + uint32_t(std::popcount(all & ((BitPlane(1) << bit) - 1)));
                        visit(place + size_t(bit / 8 * kReach + bit % 8), vertex);
                    }
                }
            }
        }
    }

    // The grid edges of the crossings `begin` to `end` - 1.
    void lay(size_t begin, size_t end, const std::array<double, 3>& origin, double voxel, GridEdges& edges) const;

    // The lower grid point and the axis of each of these edges, four numbers.
    void edges(size_t begin, size_t end, int16_t* rows) const;

    // The number after the last crossing of the brick that has this one.
    size_t end_of_brick(size_t crossing) const;

    // The numbers of these crossings; the rest is not written.
    void collect(const Octant& near, Numbers& numbers) const;

    LayerBricks bricks_of(Layers layers) const;

    // The numbers of a brick's own crossings along each axis: those of axis k are [k] to [k + 1] - 1.
    std::array<size_t, 4> ranges(size_t brick) const {
        const BrickCrossings& own = crossings_[brick];
        size_t end = brick + 1 < sampled() ? crossings_[brick + 1].base : vertices_;
        return {own.base, own.base + own.rank[1][0], own.base + own.rank[2][0], end};
    }

    // How many crossings the bricks have that come before a layer.
    size_t crossings_before(int layer) const;

    // Calls visit(edge) for the crossings that a brick with samples numbers, in order.
    template <class Visit>
    void for_each_own_edge(size_t i, const Visit& visit) const {
        if (i >= sampled()) return;
        const BrickCrossings& own = crossings_[i];
        uint32_t vertex = uint32_t(own.base);
        for (uint8_t axis = 0; axis < 3; ++axis) {
            for (int x = 0; x < kSide; ++x) {
                for (BitPlane bits = own.bits[axis][x]; bits; bits &= bits - 1) {
                    int bit = std::countr_zero(bits);
                    const int32_t* p = layout_.ijk + 3 * i;
                    visit(CellEdge{vertex++, axis, {p[0] + x, p[1] + bit / 8, p[2] + bit % 8}});
                }
            }
        }
    }

  private:
    size_t brick_of(size_t crossing) const;
    size_t lower_bound(size_t begin, size_t end, int layer) const;

    Layout layout_;
    std::vector<Signs> signs_;
    std::vector<BrickCrossings> crossings_;
    std::vector<BrickPlace> places_;
    size_t vertices_;
};

// --- Which faces of its cell the loop of crossings of a case passes.

// The face that two edges share: axis*2 + (0 lower, 1 upper).
constexpr int8_t common_face(int e, int f) {
    const Edge &a = kEdges[e], &b = kEdges[f];
    const int pa[3] = {a.dx, a.dy, a.dz}, pb[3] = {b.dx, b.dy, b.dz};
    for (int axis = 0; axis < 3; ++axis) {
        if (axis != a.axis && axis != b.axis && pa[axis] == pb[axis]) return int8_t(2 * axis + pa[axis]);
    }
    return -1;
}

// One face after each crossing; and after which crossing the loop passes the lower face along each axis, -1 where it does
// not, or twice.
struct Faces {
    std::array<int8_t, sizeof(Case::loop)> after{};
    std::array<int8_t, 3> lower{-1, -1, -1};
};

constexpr std::array<Faces, 256> make_faces() {
    std::array<Faces, 256> faces{};
    for (int c = 0; c < 256; ++c) {
        int count = kCases[c].loop_length, times[3] = {0, 0, 0};
        for (int k = 0; k < count; ++k) {
            int face = common_face(kCases[c].loop[k], kCases[c].loop[(k + 1) % count]);
            faces[c].after[k] = int8_t(face);
            if (face % 2 == 0) faces[c].lower[face / 2] = int8_t(times[face / 2]++ ? -1 : k);
        }
    }
    return faces;
}
constexpr std::array<Faces, 256> kFaces = make_faces();

}  // namespace fracslice::mesh
