// Passes over the bricks of a layer, each brick by itself: which cells have features, and where their faces may have corners;
// then which of these are corners, for both cells must have features; then which cells have two that are enough.
#include "features.h"

#include <bit>
#include <utility>

#include "finder.h"

namespace fracslice::mesh {
namespace {

// The plane read one step against y or z; `before` is the plane of the neighbour on that side.
BitPlane from_y(BitPlane plane, BitPlane before) { return plane << 8 | before >> 56; }
BitPlane from_z(BitPlane plane, BitPlane before) { return (plane << 1 & ~kFirstZ) | (before >> 7 & kFirstZ); }

// Keeps the corners between two cells with features. below: the brick's neighbours on the lower sides.
void keep_corners(Features& own, const std::array<const Features*, 3>& below) {
    for (size_t axis = 0; axis < 3; ++axis) {
        const Feature* from = own.result[axis];
        Feature* to = own.result[axis];
        Signs none{}, before = below[axis] ? below[axis]->cells : none;
        for (size_t x = 0; x < kSide; ++x) {
            BitPlane cells = own.cells[x], other = axis == 0   ? (x ? own.cells[x - 1] : before[kSide - 1])
                                               : axis == 1 ? from_y(cells, before[x])
                                                           : from_z(cells, before[x]);
            own.rank[axis][x] = uint16_t(to - own.result[axis]);
            for (BitPlane bits = own.corners[axis][x]; bits; bits &= bits - 1, ++from) {
                if (bits & -bits & other) *to++ = *from;
            }
            own.corners[axis][x] &= other;
        }
        own.counts[axis] = uint32_t(to - own.result[axis]);
    }
}

// How far from the line between its two corners a tip may lie to be left out, in voxels: as rounding has it.
constexpr double kStraight = 1e-6;

// Whether a point lies on the line from a to b.
bool between(const Vec3& point, const Vec3& a, const Vec3& b) {
    Vec3 along = b - a, off = cross(point - a, along);
    return dot(off, off) <= kStraight * kStraight * dot(along, along);
}

// The cells of plane x whose features lie between their two corners.
BitPlane straight_cells(const Features& own, const Around& around, int x, const Feature* features) {
    BitPlane one = 0, two = 0, more = 0;
    for (int face = 0; face < 6; ++face) {
        BitPlane corners = around.at(x, face);
        more |= two & corners;
        two = (two & ~corners) | (one & corners);
        one = (one ^ corners) & ~(two | more);
    }
    BitPlane straight = two & own.lined[x], left = two & ~straight;
    for (int face = 1; face < 6 && left; ++face) {
        for (int other = 0; other < face; ++other) {
            for (BitPlane cells = left & around.at(x, face) & around.at(x, other); cells; cells &= cells - 1) {
                int bit = std::countr_zero(cells);
                const Vec3& point = features[std::popcount(own.cells[x] & ((BitPlane(1) << bit) - 1))].point;
                if (between(point, around.corner(x, face, bit).point(), around.corner(x, other, bit).point())) {
                    straight |= BitPlane(1) << bit;
                }
            }
        }
    }
    return straight;
}

}  // namespace

FeatureGrid::FeatureGrid(const CellGrid& cells, Layers layers)
    : cells_(cells), near_(cells.bricks_of({layers.first - 1, layers.last + 2})), features_(near_.size()),
      along_(near_.size()), looked_(layers.first - 1) {}

void FeatureGrid::look(int layer, const Hermite& data) {
    LayerBricks bricks = cells_.bricks_of({layer, layer + 1});
    tbb::parallel_for(bricks.row, bricks.row + bricks.rows, [&](size_t i) {
        auto ranges = cells_.ranges(i);
        bool along = true;
        for (int axis = 0; axis < 3; ++axis) along = along && data.along(axis, ranges[axis], ranges[axis + 1]);
        along_[near_.place_of(i)] = along;
    });
}

bool FeatureGrid::all_along(size_t i) const {
    for (int32_t row : cells_.octant(i).rows) {
        if (row >= 0 && !along_[near_.place_of(size_t(row))]) return false;
    }
    return true;
}

void FeatureGrid::find(int layer, const Hermite& data) {
    Stores& stores = stores_[size_t(layer + 3) % 3];
    for (FeatureStore& store : stores) store.forget();
    for (; looked_ <= layer + 1; ++looked_) look(looked_, data);
    for_each_brick(cells_.bricks_of({layer, layer + 1}),
                   [&](size_t i) { find_features(cells_, data, i, all_along(i), of(i), stores.local()); });
}

void FeatureGrid::choose(int layer) {
    for_each_brick(cells_.bricks_of({layer, layer + 1}), [&](size_t i) {
        Features& own = of(i);
        if (own.counts[3]) keep_corners(own, {beside(i, 0, -1), beside(i, 1, -1), beside(i, 2, -1)});
    });
}

void FeatureGrid::straighten(int layer) {
    for_each_brick(cells_.bricks_of({layer, layer + 1}), [&](size_t i) {
        Features& own = of(i);
        own.triangles = own.loops;
        if (!own.counts[3]) return;
        Around around(*this, i);
        const Feature* features = own.result[3];
        for (int x = 0; x < kSide; ++x) {
            for (int face = 0; face < 6; ++face) own.triangles += size_t(std::popcount(around.at(x, face)));
            own.straight[x] = straight_cells(own, around, x, features);
            own.tip_count += uint32_t(std::popcount(own.cells[x] & ~own.straight[x]));
            features += std::popcount(own.cells[x]);
        }
        own.triangles -= 2 * (own.counts[3] - own.tip_count);
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
        BitPlane upper[] = {x + 1 < kSide ? own_->corners[0][x + 1] : after[0],
                        shift_y(own_->corners[1][x], above_[1]->corners[1][x]),
                        shift_z(own_->corners[2][x], above_[2]->corners[2][x])};
        for (int axis = 0; axis < 3; ++axis) {
            faces_[x][2 * axis] = own_->corners[axis][x];
            faces_[x][2 * axis + 1] = upper[axis] & own_->cells[x];
        }
    }
}

const Features* FeatureGrid::beside(size_t i, int axis, int step) const {
    BrickPlace to = cells_.place(i);
    to[axis] += step;
    int64_t at = cells_.find(to);
    return at >= 0 ? &of(size_t(at)) : nullptr;
}

}  // namespace fracslice::mesh
