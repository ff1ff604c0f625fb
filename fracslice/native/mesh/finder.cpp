#include "finder.h"

#include <cassert>

#include "faces.h"

namespace fracslice::mesh {
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
