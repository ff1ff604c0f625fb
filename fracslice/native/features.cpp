// Passes over the bricks of a layer, each brick by itself: which cells have features, and where their faces may have corners;
// then which of these are corners, for both cells must have features; then which cells have two that are enough.
#include "features.h"

#include <utility>

#include "faces.h"

namespace fracslice {
namespace {

// What is known of a crossing; a brick's are laid side by side, for its cells look at each up to four times.
struct Datum {
    double t;
    Normal normal;
};

// An edge of the unit cell.
struct Way {
    Vec3 start{}, along{};
};

constexpr std::array<Way, 12> make_ways() {
    std::array<Way, 12> ways{};
    for (int e = 0; e < 12; ++e) {
        ways[e].start = {double(kEdges[e].dx), double(kEdges[e].dy), double(kEdges[e].dz)};
        ways[e].along[kEdges[e].axis] = 1;
    }
    return ways;
}
constexpr std::array<Way, 12> kWays = make_ways();

// The features of one brick.
class Finder {
  public:
    Finder(const CellGrid& cells, Hermite data, size_t i) : near_(cells, i), margin_(data.margin) {
        uint32_t seen = 0;
        cells.for_each_near(near_.octant, [&](size_t at, uint32_t vertex) {
            near_.numbers[at] = seen;
            data_[seen++] = {data.root(vertex), data.normal(vertex)};
        });
    }

    void find(Features& own, FeatureStore& store) {
        near_.for_each([&](const Cell& cell) {
            const Case& type = kCases[cell.number];
            Vec3 tip;
            if (!type.loop_length || !bent(cell) || !meet(cell, tip)) {
                own.loops += type.triangles;
                return;
            }
            own.loops += type.loop_length;
            own.cells[cell.x] |= cell.bit();
            store.add(3, {cell.lower + tip, cell.number});
            for (int axis = 0; axis < 3; ++axis) {
                Vec3 corner;
                if (!corner_in(cell, axis, corner)) continue;
                own.corners[axis][cell.x] |= cell.bit();
                store.add(axis, {cell.lower + corner, cell.number});
            }
        });
        store.keep(own);
    }

  private:
    // What is known of a crossing of a cell's loop.
    const Datum& datum(const Cell& cell, int k) const { return data_[cell.at(kCases[cell.number].loop[k])]; }

    // Whether two normals of a cell's loop of crossings make a feature.
    bool bent(const Cell& cell) const {
        const Normal& first = datum(cell, 0).normal;
        int length = kCases[cell.number].loop_length;
        float least = 1;
        for (int k = 1; k < length; ++k) least = std::min(least, dot(first, datum(cell, k).normal));
        if (least > kHalfSharp) return false;
        bool found = least < kSharp;
        for (int a = 2; a < length && !found; ++a) {
            for (int b = 1; b < a; ++b) found |= dot(datum(cell, a).normal, datum(cell, b).normal) < kSharp;
        }
        return found;
    }

    // Where the planes of a cell's crossings meet, if they do.
    bool meet(const Cell& cell, Vec3& tip) {
        const Case& type = kCases[cell.number];
        for (int k = 0; k < type.loop_length; ++k) {
            const Datum& from = datum(cell, k);
            const Way& way = kWays[type.loop[k]];
            loop_[k].point = way.start + from.t * way.along;
            for (int j = 0; j < 3; ++j) loop_[k].normal[j] = from.normal[j];
        }
        return feature_point(loop_.data(), type.loop_length, margin_, tip);
    }

    // The corner of the trace in a cell's lower face along `axis`, if there is one. A face that the loop passes twice has
    // none: two could cross.
    bool corner_in(const Cell& cell, int axis, Vec3& corner) const {
        int k = kFaces[cell.number].lower[axis];
        if (k < 0) return false;
        const Crossing &a = loop_[k], &b = loop_[k + 1 < kCases[cell.number].loop_length ? k + 1 : 0];
        return sharp(a, b) && face_corner(a, b, axis, margin_, corner);
    }

    Near near_;
    double margin_;
    std::array<Datum, std::tuple_size<Numbers>::value> data_;
    std::array<Crossing, sizeof(Case::loop)> loop_;
};

// The slab read one step against y or z; `before` is the slab of the neighbour on that side.
Slab from_y(Slab slab, Slab before) { return slab << 8 | before >> 56; }
Slab from_z(Slab slab, Slab before) { return (slab << 1 & ~kFirstZ) | (before >> 7 & kFirstZ); }

// Keeps the corners between two cells with features. below: the brick's neighbours on the lower sides.
void keep_corners(Features& own, const std::array<const Features*, 3>& below) {
    const Feature* from = own.points;
    Feature* to = own.points;
    for (int axis = 0; axis < 3; ++axis) {
        Signs none{}, before = below[axis] ? below[axis]->cells : none;
        for (int x = 0; x < kSide; ++x) {
            Slab cells = own.cells[x], other = axis == 0   ? (x ? own.cells[x - 1] : before[kSide - 1])
                                               : axis == 1 ? from_y(cells, before[x])
                                                           : from_z(cells, before[x]);
            for (Slab bits = own.corners[axis][x]; bits; bits &= bits - 1, ++from) {
                if (bits & -bits & other) *to++ = *from;
            }
            own.corners[axis][x] &= other;
            own.rank[axis][x] = uint16_t(own.corner_count);
            own.corner_count += uint32_t(popcount(own.corners[axis][x]));
        }
    }
    std::copy(from, const_cast<const Feature*>(from + own.cell_count), to);
}

// How far from the line between its two corners a tip may lie to be left out, in voxels: as rounding has it.
constexpr double kStraight = 1e-6;

// Whether a point lies on the line from a to b.
bool between(const Vec3& point, const Vec3& a, const Vec3& b) {
    Vec3 along = b - a, off = cross(point - a, along);
    return dot(off, off) <= kStraight * kStraight * dot(along, along);
}

// The cells of slab x whose features lie between their two corners.
Slab straight_cells(const Features& own, const Around& around, int x, const Feature* features) {
    Slab one = 0, two = 0, more = 0, straight = 0;
    for (int face = 0; face < 6; ++face) {
        Slab corners = around.at(x, face);
        more |= two & corners;
        two = (two & ~corners) | (one & corners);
        one = (one ^ corners) & ~(two | more);
    }
    for (int face = 1; face < 6; ++face) {
        for (int other = 0; other < face; ++other) {
            for (Slab cells = two & around.at(x, face) & around.at(x, other); cells; cells &= cells - 1) {
                int bit = __builtin_ctzll(cells);
                const Vec3& point = features[popcount(own.cells[x] & ((Slab(1) << bit) - 1))].point;
                if (between(point, around.corner(x, face, bit).point(), around.corner(x, other, bit).point())) {
                    straight |= Slab(1) << bit;
                }
            }
        }
    }
    return straight;
}

}  // namespace

void FeatureStore::keep(Features& of) {
    size_t count = 0;
    for (size_t some : count_) count += some;
    if (block_ == blocks_.size() || used_ + count > blocks_[block_].rows) {
        if (block_ < blocks_.size()) ++block_;
        if (block_ == blocks_.size()) blocks_.emplace_back(kBlock, 1);
        used_ = 0;
    }
    Feature* next = of.points = blocks_[block_].data.get() + used_;
    of.cell_count = uint32_t(count_[3]);
    used_ += count;
    for (int axis = 0; axis < 4; ++axis) {
        next = std::copy(found_[axis].begin(), found_[axis].begin() + std::exchange(count_[axis], 0), next);
    }
}

FeatureGrid::FeatureGrid(const CellGrid& cells, Layers layers)
    : cells_(cells), near_(cells.span({layers.first - 1, layers.last + 1})), features_(near_.size()) {}

void FeatureGrid::find(int layer, const Hermite& data) {
    Stores& stores = stores_[size_t(layer + 3) % 3];
    for (FeatureStore& store : stores) store.forget();
    for_each_brick(cells_.span({layer, layer + 1}),
                   [&](size_t i) { Finder(cells_, data, i).find(of(i), stores.local()); });
}

void FeatureGrid::choose(int layer) {
    for_each_brick(cells_.span({layer, layer + 1}), [&](size_t i) {
        Features& own = of(i);
        if (own.cell_count) keep_corners(own, {beside(i, 0, -1), beside(i, 1, -1), beside(i, 2, -1)});
    });
}

void FeatureGrid::straighten(int layer) {
    for_each_brick(cells_.span({layer, layer + 1}), [&](size_t i) {
        Features& own = of(i);
        own.triangles = own.loops;
        if (!own.cell_count) return;
        Around around(*this, i);
        const Feature* features = own.points + own.corner_count;
        for (int x = 0; x < kSide; ++x) {
            for (int face = 0; face < 6; ++face) own.triangles += size_t(popcount(around.at(x, face)));
            own.straight[x] = straight_cells(own, around, x, features);
            own.tip_count += uint32_t(popcount(own.cells[x] & ~own.straight[x]));
            features += popcount(own.cells[x]);
        }
        own.triangles -= 2 * (own.cell_count - own.tip_count);
    });
}

Around::Around(const FeatureGrid& grid, size_t i) : own_(&grid.of(i)) {
    static const Features none;
    for (int axis = 0; axis < 3; ++axis) {
        const Features* above = grid.beside(i, axis, 1);
        above_[axis] = above ? above : &none;
    }
    for (int x = 0; x < kSide; ++x) {
        const Signs& after = above_[0]->corners[0];
        Slab upper[] = {x + 1 < kSide ? own_->corners[0][x + 1] : after[0],
                        shift_y(own_->corners[1][x], above_[1]->corners[1][x]),
                        shift_z(own_->corners[2][x], above_[2]->corners[2][x])};
        for (int axis = 0; axis < 3; ++axis) {
            faces_[x][2 * axis] = own_->corners[axis][x];
            faces_[x][2 * axis + 1] = upper[axis] & own_->cells[x];
        }
    }
}

const Features* FeatureGrid::beside(size_t i, int axis, int step) const {
    Place to = cells_.place(i);
    to[axis] += step;
    int64_t at = cells_.find(to);
    return at >= 0 ? &of(size_t(at)) : nullptr;
}

}  // namespace fracslice
