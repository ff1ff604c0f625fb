// Passes over the bricks of a layer, each brick by itself: which cells have features, and where their faces may have corners;
// then which of these are corners, for both cells must have features; then which cells have two that are enough.
#include "features.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <utility>

#include "cells.h"

namespace fracslice::mesh {
namespace {

// A symmetric matrix: its diagonal, and the elements that are left where row and column k are struck out.
struct Symmetric {
    Vec3 diagonal{}, other{};

    Vec3 row(int k) const {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        Vec3 result;
        result[k] = diagonal[k], result[u] = other[v], result[v] = other[u];
        return result;
    }
};

// The rows of the adjugate; as symmetric as the matrix. Their products with the matrix' rows are its determinant.
std::array<Vec3, 3> adjugate(const Symmetric& a) {
    Vec3 x = a.row(0), y = a.row(1), z = a.row(2);
    return {cross(y, z), cross(z, x), cross(x, y)};
}

// The least eigenvalue: Newton's method on the characteristic polynomial, which comes to it from below.
double least_eigenvalue(double trace, double minors, double determinant) {
    double value = determinant / minors;
    for (int step = 0; step < 20 && value > 0; ++step) {
        double p = ((trace - value) * value - minors) * value + determinant;
        double further = p / (minors - (2 * trace - 3 * value) * value);
        if (!(further > 0)) break;
        value += further;
        if (further < 1e-3 * trace) break;  // The error is of the order of its square.
    }
    return value;
}

Vec3 product(const std::array<Vec3, 3>& rows, const Vec3& b) { return {dot(rows[0], b), dot(rows[1], b), dot(rows[2], b)}; }

// The unit eigenvector of a simple eigenvalue `value` of A: the adjugate of A - value I is the outer product of that vector
// with itself, times a factor.
Vec3 eigenvector(const Symmetric& a, std::array<Vec3, 3> adjugate, double trace, double value) {
    int longest = 0;
    for (int k = 0; k < 3; ++k) {
        adjugate[k] = adjugate[k] + value * a.row(k);
        adjugate[k][k] += value * (value - trace);
        if (adjugate[k][k] > adjugate[longest][longest]) longest = k;
    }
    const Vec3& v = adjugate[longest];
    double square = dot(v, v);
    return square > 0 ? (1 / std::sqrt(square)) * v : Vec3{0, 0, 1};
}

// Directions whose eigenvalue is a smaller share of the trace say nothing about where the planes meet.
constexpr double kRank = 0.01;

// How far outside its cell a feature may lie to be moved to the cell's border instead of being given up. The edge of an acute
// wedge enters cells without crossings, and is moved from further there.
constexpr double kNear = 0.4, kNearWedge = 1;

// How far from its planes a feature may lie, root mean square.
constexpr double kMiss = 0.06;

// Moves a point to the border of the unit cell, `margin` inside, if it is not further outside than `near`.
bool moved_inside(Vec3& point, double margin, double near = kNear) {
    for (double& x : point) {
        if (!(x > -near && x < 1 + near)) return false;
        x = std::clamp(x, margin, 1 - margin);
    }
    return true;
}

// Whether a point is in the unit cell, `margin` from its faces.
bool inside(const Vec3& p, double margin) {
    return std::min({p[0], p[1], p[2]}) >= margin && std::max({p[0], p[1], p[2]}) <= 1 - margin;
}

// Whether a point whose distances from `count` planes have this sum of squares is near enough to them.
bool fits(double squares, int count) { return squares < kMiss * kMiss * count; }

// The point of a line in the unit cell that is nearest to `start`; where the line misses the cell by little, the
// cell's point beside it.
bool clipped(const Vec3& start, const Vec3& direction, double margin, double near, Vec3& point) {
    double first = -10, last = 10;
    for (int k = 0; k < 3; ++k) {
        double low = margin - start[k], high = 1 - margin - start[k];
        if (std::abs(direction[k]) < 1e-9) {
            if (low > near || high < -near) return false;
            continue;
        }
        double over = 1 / direction[k], p = low * over, q = high * over;
        first = std::max(first, std::min(p, q));
        last = std::min(last, std::max(p, q));
    }
    double at = first <= last ? std::clamp(0.0, first, last) : (first + last) / 2;
    point = start + at * direction;
    return moved_inside(point, margin, near);
}

// Normals of a wedge: two directions at more than this angle (70 degrees), and none between them.
constexpr double kWedge = 0.34, kOneSide = 0.95;

// Whether the crossings lie on the two sides of a wedge. The edge of a round ridge has normals of all directions between.
bool wedge(std::span<const Crossing> crossings) {
    const Vec3 *one = nullptr, *two = nullptr;
    double least = kWedge;
    for (const Crossing& a : crossings) {
        for (const Crossing& b : crossings) {
            double cosine = dot(a.normal, b.normal);
            if (cosine < least) least = cosine, one = &a.normal, two = &b.normal;
        }
    }
    if (!one) return false;
    return std::all_of(crossings.begin(), crossings.end(), [&](const Crossing& c) {
        return std::max(dot(c.normal, *one), dot(c.normal, *two)) > kOneSide;
    });
}

}  // namespace

bool feature_point(std::span<const Crossing> crossings, double margin, Vec3& point) {
    const int count = int(crossings.size());
    Vec3 mean{};
    for (const Crossing& crossing : crossings) mean = mean + (1.0 / count) * crossing.point;
    Symmetric a;
    Vec3 b{};
    double miss = 0;
    for (const Crossing& crossing : crossings) {
        const Vec3& n = crossing.normal;
        double d = dot(n, crossing.point - mean);
        miss += d * d;
        for (int k = 0; k < 3; ++k) {
            a.diagonal[k] += n[k] * n[k];
            a.other[k] += n[(k + 1) % 3] * n[(k + 2) % 3];
            b[k] += d * n[k];
        }
    }
    // Where two planes meet is a line; a third direction, if the planes tell it, makes it a corner. The trace is `count`; the
    // determinant over the sum of the minors is the least eigenvalue, or a little less.
    auto inverse = adjugate(a);
    double determinant = dot(a.row(0), inverse[0]), minors = inverse[0][0] + inverse[1][1] + inverse[2][2];
    if (!(minors > 2 * kRank * count * count)) return false;
    if (determinant > kRank * minors * count) {
        Vec3 best = (1 / determinant) * product(inverse, b);
        if (!fits(miss - dot(b, best), count)) return false;
        point = mean + best;
        if (moved_inside(point, margin)) return true;
    }
    double least = least_eigenvalue(count, minors, determinant), others = count - least;
    Vec3 along = eigenvector(a, inverse, count, least);
    // Across that direction the matrix solves its characteristic polynomial, which is so its inverse (Cayley and Hamilton).
    Vec3 rest = b - dot(along, b) * along;
    Vec3 best = (1 / (minors - least * others)) * (others * rest - product({a.row(0), a.row(1), a.row(2)}, rest));
    if (!fits(miss - dot(b, best), count)) return false;
    point = mean + best;
    if (inside(point, margin)) return true;
    if (wedge(crossings)) return clipped(mean + best, along, margin, kNearWedge, point);
    if (!clipped(mean + best, along, margin, kNear, point)) return false;
    miss = 0;
    for (const Crossing& crossing : crossings) {
        double d = dot(crossing.normal, point - crossing.point);
        miss += d * d;
    }
    return fits(miss, count);
}

bool face_corner(const Crossing& a, const Crossing& b, int axis, double margin, Vec3& corner) {
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    double au = a.normal[u], av = a.normal[v], bu = b.normal[u], bv = b.normal[v];
    double det = au * bv - av * bu, square = (au * au + av * av) * (bu * bu + bv * bv);
    if (!(det * det > 0.09 * square) || square < 0.0025) return false;
    double ca = au * a.point[u] + av * a.point[v], cb = bu * b.point[u] + bv * b.point[v];
    corner[axis] = 0.5;
    corner[u] = (ca * bv - cb * av) / det;
    corner[v] = (au * cb - bu * ca) / det;
    bool near = moved_inside(corner, margin, dot(a.normal, b.normal) < kWedge ? kNearWedge : kNear);
    corner[axis] = 0;
    return near;
}

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

namespace {

// A brick's cells, their crossings numbered as they are seen; and these.
struct Seen {
    BrickCells near;
    std::array<uint32_t, std::tuple_size<Numbers>::value> vertices;
    std::array<double, std::tuple_size<Numbers>::value> roots;
    uint32_t count = 0;

    Seen(const CellGrid& cells, const Hermite& data, size_t i) : near(cells, i) {
        cells.for_each_near(near.octant, [&](size_t place, uint32_t vertex) {
            near.numbers[place] = count;
            vertices[count] = vertex;
            roots[count++] = data.root(vertex);
        });
    }
};

// Root and normal of a crossing; those of a brick are contiguous, as its cells read each up to four times.
struct Datum {
    double t;
    Normal normal;
};

// An edge of the unit cell.
struct UnitEdge {
    Vec3 start{}, along{};
};

constexpr std::array<UnitEdge, 12> make_unit_edges() {
    std::array<UnitEdge, 12> edges{};
    for (int e = 0; e < 12; ++e) {
        edges[e].start = {double(kEdges[e].dx), double(kEdges[e].dy), double(kEdges[e].dz)};
        edges[e].along[kEdges[e].axis] = 1;
    }
    return edges;
}
constexpr std::array<UnitEdge, 12> kUnitEdges = make_unit_edges();

// The features of one brick.
class Finder {
  public:
    Finder(const Seen& seen, const Hermite& data) : seen_(seen), margin_(data.margin) {
        for (uint32_t k = 0; k < seen.count; ++k) data_[k] = {seen.roots[k], data.normal(seen.vertices[k])};
    }

    void find(Features& own) {
        seen_.near.for_each([&](const Cell& cell) {
            const Case& type = kCases[cell.number];
            Vec3 tip;
            bool sharp = type.loop_length && bent(cell);
            if (!sharp || !meet(cell, tip)) {
                own.loops += type.triangles;
                if (sharp) own.blunt[cell.x] |= cell.bit();
                return;
            }
            assert(inside(tip));
            if (moved(tip)) own.blunt[cell.x] |= cell.bit();
            own.loops += type.loop_length;
            own.cells[cell.x] |= cell.bit();
            own.add(3, {cell.lower + tip, to_mean(tip, 0, length_), cell.number});
            for (int axis = 0; axis < 3; ++axis) {
                Vec3 corner;
                if (!corner_in(cell, axis, corner)) continue;
                if (moved(corner)) own.blunt[cell.x] |= cell.bit();
                assert(corner[axis] == 0 && inside(corner, axis));
                own.corners[axis][cell.x] |= cell.bit();
                own.add(size_t(axis), {cell.lower + corner, to_mean(corner, kFaces[cell.number].lower[axis], 2), cell.number});
            }
        });
    }

  private:
    // Datum of a crossing of a cell's loop.
    const Datum& datum(const Cell& cell, int k) const { return data_[cell.at(kCases[cell.number].loop[k])]; }

    // Whether two normals of a cell's loop of crossings make a feature.
    bool bent(const Cell& cell) const {
        const Normal& first = datum(cell, 0).normal;
        int length = kCases[cell.number].loop_length;
        float least = 1;
        for (int k = 1; k < length; ++k) least = std::min(least, dot(first, datum(cell, k).normal));
        if (least > kHalfSharp) return false;
        bool result = least < kSharp;
        for (int a = 2; a < length && !result; ++a) {
            for (int b = 1; b < a; ++b) result |= dot(datum(cell, a).normal, datum(cell, b).normal) < kSharp;
        }
        return result;
    }

    // Where the planes of a cell's crossings meet, if they do.
    bool meet(const Cell& cell, Vec3& tip) {
        const Case& type = kCases[cell.number];
        length_ = type.loop_length;
        for (int k = 0; k < length_; ++k) {
            const Datum& from = datum(cell, k);
            const UnitEdge& way = kUnitEdges[type.loop[k]];
            loop_[k].point = way.start + from.t * way.along;
            for (int j = 0; j < 3; ++j) loop_[k].normal[j] = from.normal[j];
        }
        return feature_point({loop_.data(), size_t(length_)}, margin_, tip);
    }

    // The corner of the trace in a cell's lower face along `axis`, if there is one. A face that the loop passes twice has
    // none: two could cross.
    bool corner_in(const Cell& cell, int axis, Vec3& corner) const {
        int k = kFaces[cell.number].lower[axis];
        if (k < 0) return false;
        const Crossing &a = loop_[k], &b = loop_[k + 1 < length_ ? k + 1 : 0];
        return sharp(a, b) && face_corner(a, b, axis, margin_, corner);
    }

    // Whether a point lies strictly inside the unit cell, or inside its face across an axis: fans around it do not meet themselves.
    static bool inside(const Vec3& p, int face = -1) {
        bool within = true;
        for (int k = 0; k < 3; ++k) within &= k == face || (p[k] > 0 && p[k] < 1);
        return within;
    }

    // Whether a point was moved to the border of its cell or face.
    bool moved(const Vec3& p) const {
        return std::any_of(p.begin(), p.end(), [&](double x) { return x == margin_ || x == 1 - margin_; });
    }

    // The way from a point to the mean of `count` crossings of the loop from number `first` on.
    std::array<float, 3> to_mean(const Vec3& point, int first, int count) const {
        Vec3 sum{};
        for (int k = first; k < first + count; ++k) sum = sum + loop_[k < length_ ? k : 0].point;
        Vec3 way = (1.0 / count) * sum - point;
        return {float(way[0]), float(way[1]), float(way[2])};
    }

    const Seen& seen_;
    double margin_;
    std::array<Datum, std::tuple_size<Numbers>::value> data_;
    std::array<Crossing, sizeof(Case::loop)> loop_;
    int length_ = 0;  // of that
};

// What the loop of a case is, where each crossing's plane is across its edge.
struct Planes {
    uint8_t length = 0, known = 0;                          // crossings; axes that they tell
    std::array<uint16_t, sizeof(Case::loop)> places{};      // of the crossings in Numbers
    std::array<uint8_t, sizeof(Case::loop)> first{}, axis{};  // the first one along the same axis, and that
    std::array<int8_t, 3> by_axis{-1, -1, -1};              // the first along each axis
    std::array<double, 3> middle{};                         // of the crossings, along the axes that they do not tell
    std::array<bool, 3> corner{};                           // whether the trace in the lower face along each axis has one
};

constexpr std::array<Planes, 256> make_planes() {
    std::array<Planes, 256> all{};
    for (int c = 0; c < 256; ++c) {
        const Case& type = kCases[c];
        Planes& own = all[c];
        own.length = type.loop_length;
        for (uint8_t k = 0; k < own.length; ++k) {
            const Edge& e = kEdges[type.loop[k]];
            if (own.by_axis[e.axis] < 0) own.by_axis[e.axis] = int8_t(k), ++own.known;
            own.places[k] = kPlaces[type.loop[k]];
            own.first[k] = uint8_t(own.by_axis[e.axis]);
            own.axis[k] = e.axis;
            const int start[3] = {e.dx, e.dy, e.dz};
            for (int j = 0; j < 3; ++j) own.middle[j] += double(start[j]) / own.length;
        }
        for (int axis = 0; axis < 3; ++axis) {
            int k = kFaces[c].lower[axis];
            own.corner[axis] = k >= 0 && own.axis[k] != own.axis[(k + 1) % own.length];
        }
    }
    return all;
}
constexpr std::array<Planes, 256> kPlanes = make_planes();

// Maximum distance of roots in one plane, voxels.
constexpr double kSame = 1e-9;

// The same where every plane is across its crossing's edge: each says one coordinate, and which is a matter of the case.
bool find_across(const Seen& seen, Features& own) {
    bool exact = true;
    auto find = [&](const Cell& cell) {
        const Planes& planes = kPlanes[cell.number];
        own.loops += kCases[cell.number].triangles;
        if (planes.known < 2) return;
        std::array<double, sizeof(Case::loop)> t;
        double off = 0;
        for (int k = 0; k < planes.length; ++k) {
            t[k] = seen.roots[cell.numbers[planes.places[k]]];
            off = std::max(off, std::abs(t[k] - t[planes.first[k]]));
        }
        exact = exact && off < kSame;
        own.loops += uint32_t(planes.length - kCases[cell.number].triangles);
        own.cells[cell.x] |= cell.bit();
        if (planes.known == 2) own.lined[cell.x] |= cell.bit();
        Vec3 tip, corner;
        for (int axis = 0; axis < 3; ++axis) {
            int k = planes.by_axis[axis];
            tip[axis] = cell.lower[axis] + (k < 0 ? planes.middle[axis] : t[k]);
        }
        own.add(3, {tip, {}, cell.number});
        for (size_t axis = 0; axis < 3; ++axis) {
            if (!planes.corner[axis]) continue;
            corner = tip;
            corner[axis] = cell.lower[axis];
            own.corners[axis][cell.x] |= cell.bit();
            own.add(axis, {corner, {}, cell.number});
        }
    };
    for (int x = 0; x < kSide; ++x) {
        Passed cells(seen.near.corners[x], seen.near.corners[x + 1]);
        own.loops += 2 * uint32_t(cells.flat_count());
        seen.near.for_each(x, cells.rest, find);
    }
    return exact;
}

}  // namespace

void find_features(const CellGrid& cells, const Hermite& data, size_t i, bool along, Features& own, FeatureStore& store) {
    Seen seen(cells, data, i);
    store.open(own);
    if (!along || !find_across(seen, own)) {
        own = {};
        store.open(own);
        Finder(seen, data).find(own);
    }
    store.keep(own);
}

}  // namespace fracslice::mesh
