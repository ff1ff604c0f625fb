// Passes over the bricks, each brick by itself: which cells have tips, and where their faces may have corners; which of these
// are corners, for both cells must have tips; how many triangles that makes; then vertices and triangles at the places that
// the sums of the counts give.
#include "contour.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "cells.h"

namespace fracslice {
namespace {

// A vertex that is no crossing, and corners of its cell near it: one inside, and 8 times one outside.
struct Feature {
    Vec3 point;
    uint8_t ends;
};

// The features of a brick's cells: bit y*8 + z of slab x for each cell with a tip, and for its lower face along each axis.
struct Features {
    Signs tips{};
    std::array<Signs, 3> corners{};
    std::array<std::array<uint16_t, kSide>, 3> rank{};  // corners of this brick before that slab
    Feature* points = nullptr;                          // the corners by axis, then the tips, in the order of their cells
    uint32_t count = 0;                                 // of these
    uint32_t loops = 0;                                 // triangles that these cells would have without corners
    size_t tip_base = 0, corner_base = 0, triangles = 0;
};

// Where one thread finds features and keeps them.
class Store {
  public:
    std::array<std::vector<Feature>, 4> found;  // of a brick: the corners by axis, then the tips

    // Keeps what was found in a brick and is ready for the next one.
    void keep(Features& of) {
        size_t count = 0;
        for (const auto& some : found) count += some.size();
        if (count > room_) {
            room_ = std::max(count, kBlock);
            blocks_.emplace_back(room_, 1);
            next_ = blocks_.back().data.get();
        }
        of.points = next_;
        of.count = uint32_t(count);
        for (auto& some : found) {
            next_ = std::copy(some.begin(), some.end(), next_);
            some.clear();
        }
        room_ -= count;
    }

  private:
    static constexpr size_t kBlock = size_t(1) << 18;
    std::vector<Array<Feature>> blocks_;
    Feature* next_ = nullptr;
    size_t room_ = 0;
};

// The face that two edges share: axis*2 + (0 lower, 1 upper).
constexpr int8_t common_face(int e, int f) {
    const Edge &a = kEdges[e], &b = kEdges[f];
    const int pa[3] = {a.dx, a.dy, a.dz}, pb[3] = {b.dx, b.dy, b.dz};
    for (int axis = 0; axis < 3; ++axis) {
        if (axis != a.axis && axis != b.axis && pa[axis] == pb[axis]) return int8_t(2 * axis + pa[axis]);
    }
    return -1;
}

// The faces that a case's loop passes, one after each crossing; and after which crossing it passes the lower face along each
// axis, -1 where it does not, or twice.
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

// The ends of a feature in a cell's lower face along axis 0, 1 or 2, or in the cell (3), by case and the octant it is in: the
// corner with fewest steps to that octant's, of either sign.
using Ends = std::array<std::array<std::array<uint8_t, 8>, 256>, 4>;

constexpr Ends make_ends() {
    Ends ends{};
    for (int axis = 0; axis < 4; ++axis) {
        for (int number = 0; number < 256; ++number) {
            for (int octant = 0; octant < 8; ++octant) {
                int least[2] = {4, 4}, nearest[2] = {0, 0};
                for (int k = 0; k < 8; ++k) {
                    int outside = !(number >> k & 1), d = k ^ octant, steps = (d & 1) + (d >> 1 & 1) + (d >> 2);
                    if (k >> axis & 1 || steps >= least[outside]) continue;
                    least[outside] = steps, nearest[outside] = k;
                }
                ends[axis][number][octant] = uint8_t(nearest[0] | nearest[1] << 3);
            }
        }
    }
    return ends;
}
constexpr Ends kEnds = make_ends();

// Where Numbers holds the crossing on each edge of the cell at 0, 0, 0.
constexpr std::array<uint16_t, 12> make_places() {
    std::array<uint16_t, 12> places{};
    for (int e = 0; e < 12; ++e) places[e] = uint16_t(number_at(kEdges[e].axis, kEdges[e].dx, kEdges[e].dy, kEdges[e].dz));
    return places;
}
constexpr std::array<uint16_t, 12> kPlaces = make_places();

// The slab read one step against y or z; `before` is the slab of the neighbour on that side.
Slab from_y(Slab slab, Slab before) { return slab << 8 | before >> 56; }
Slab from_z(Slab slab, Slab before) { return (slab << 1 & ~kFirstZ) | (before >> 7 & kFirstZ); }

int popcount(Slab bits) { return __builtin_popcountll(bits); }

// A brick with what the cells in it look at; its crossings are still to be numbered.
struct Near {
    Octant octant;
    std::array<Corners, kSide + 1> corners;
    Numbers numbers;

    Near(const CellGrid& cells, size_t i) : octant(cells.octant(i)), corners(corners_of(octant, cells.signs())) {}
};

// What is known of a crossing; a brick's are laid side by side, for its cells look at each up to four times.
struct Datum {
    double t;
    Vec3 normal;
};

// A cell: its lower corner relative to its brick, and in grid units; its case; where Numbers holds its crossings.
struct Cell {
    int x, y, z;
    Vec3 lower;
    uint8_t number;
    const uint32_t* numbers;

    uint32_t at(int e) const { return numbers[kPlaces[e]]; }
    Slab bit() const { return Slab(1) << (y * 8 + z); }
};

class Contouring {
  public:
    Contouring(const CellGrid& cells, Layers layers, const Hermite& data, const Placement& placement)
        : cells_(cells), layers_(layers), near_(cells.span({layers.first - 1, layers.last + 1})), data_(data),
          placement_(placement), margin_(placement.clamp), first_datum_(cells.crossings_before(layers.first - 1)),
          first_vertex_(cells.crossings_before(layers.first)), features_(near_.size()) {
        size_t wanted = cells.crossings_before(layers.last + 2) - first_datum_;
        if (data.count != wanted) {
            throw std::invalid_argument("expected " + std::to_string(wanted) + " crossings, found " +
                                        std::to_string(data.count));
        }
    }

    Contour run() {
        Span own = cells_.span(layers_), numbered = cells_.span({layers_.first, layers_.last + 1});
        each(near_, [&](size_t i) { find(i); });
        each(numbered, [&](size_t i) { choose(i); });
        each(own, [&](size_t i) { count(i); });
        result_.crossings = cells_.crossings_before(layers_.last + 1) - first_vertex_;
        result_.corners = running_sum(features_, &Features::corner_base, "vertices");
        result_.tips = running_sum(features_, &Features::tip_base, "vertices");
        result_.triangles = {running_sum(features_, &Features::triangles, "triangles"), 3};
        size_t total = result_.crossings + result_.corners + result_.tips;
        if (total > kMostElements) throw std::length_error("the surface has more than 2^31 vertices");
        result_.vertices = {total, 3};
        result_.ends = {result_.corners + result_.tips, 1};
        each(numbered, [&](size_t i) { write_vertices(i); });
        each(own, [&](size_t i) { write_triangles(i); });
        return std::move(result_);
    }

  private:
    using Loop = std::array<Crossing, sizeof(Case::loop)>;
    using Data = std::array<Datum, std::tuple_size<Numbers>::value>;

    template <class Do>
    static void each(const Span& span, const Do& act) {
        tbb::parallel_for(size_t(0), span.size(), [&](size_t k) { act(span.brick(k)); });
    }

    template <class Visit>
    void for_each(const Near& near, size_t i, const Visit& visit) const {
        const Place& p = cells_.place(i);
        for_each_cell(near.corners, [&](int x, int y, int z, uint8_t number) {
            Vec3 lower = {double(p[0] * kSide + x), double(p[1] * kSide + y), double(p[2] * kSide + z)};
            visit(Cell{x, y, z, lower, number, &near.numbers[number_at(0, x, y, z)]});
        });
    }

    Features& features(size_t i) { return features_[near_.place_of(i)]; }
    const Features& features(size_t i) const { return features_[near_.place_of(i)]; }

    // The features of the brick one step from brick i along an axis; null if the surface passes no cell of it.
    const Features* beside(size_t i, int axis, int step) const {
        Place to = cells_.place(i);
        to[axis] += step;
        int64_t at = cells_.find(to, 0, 0, 0);
        return at >= 0 ? &features(size_t(at)) : nullptr;
    }

    double root(size_t vertex) const {
        double t = data_.t[vertex - first_datum_];
        return t > margin_ ? (t < 1 - margin_ ? t : 1 - margin_) : margin_;
    }

    Datum datum(size_t vertex) const {
        const double* n = data_.normals + (vertex - first_datum_);
        return {root(vertex), {n[0], n[data_.count], n[2 * data_.count]}};
    }

    // Fills in the normals of a cell's loop of crossings; returns whether two of them make a feature.
    static bool bent(const Cell& cell, const Data& data, Loop& loop) {
        const Case& type = kCases[cell.number];
        double least = 1;
        for (int a = 0; a < type.loop_length; ++a) {
            loop[a].normal = data[cell.at(type.loop[a])].normal;
            least = std::min(least, dot(loop[0].normal, loop[a].normal));
        }
        if (least > kHalfSharp) return false;
        bool found = least < kSharp;
        for (int a = 2; a < type.loop_length && !found; ++a) {
            for (int b = 1; b < a; ++b) found |= sharp(loop[a], loop[b]);
        }
        return found;
    }

    static void place(const Cell& cell, const Data& data, Loop& loop) {
        const Case& type = kCases[cell.number];
        for (int a = 0; a < type.loop_length; ++a) {
            const Edge& edge = kEdges[type.loop[a]];
            loop[a].point = cell.lower + Vec3{double(edge.dx), double(edge.dy), double(edge.dz)};
            loop[a].point[edge.axis] += data[cell.at(type.loop[a])].t;
        }
    }

    void find(size_t i) {
        Near near(cells_, i);
        Data data;
        uint32_t seen = 0;
        cells_.for_each_near(near.octant, [&](size_t at, uint32_t vertex) {
            near.numbers[at] = seen;
            data[seen++] = datum(vertex);
        });
        Features& own = features(i);
        Store& store = stores_.local();
        for_each(near, i, [&](const Cell& cell) {
            const Case& type = kCases[cell.number];
            Loop loop;
            Vec3 point;
            if (bent(cell, data, loop) && (place(cell, data, loop), feature_point(loop.data(), type.loop_length, cell.lower, margin_, point))) {
                own.tips[cell.x] |= cell.bit();
                own.loops += type.loop_length;
                store.found[3].push_back({point, ends(cell, point, 3)});
                for (int axis = 0; axis < 3; ++axis) {
                    if (!corner_in(cell, loop, axis, point)) continue;
                    own.corners[axis][cell.x] |= cell.bit();
                    store.found[axis].push_back({point, ends(cell, point, axis)});
                }
                return;
            }
            own.loops += type.triangles;
        });
        store.keep(own);
    }

    // The corner of the trace in a cell's lower face along `axis`, if there is one. A face that the loop passes twice has
    // none: two could cross.
    bool corner_in(const Cell& cell, const Loop& loop, int axis, Vec3& corner) const {
        int k = kFaces[cell.number].lower[axis];
        if (k < 0) return false;
        const Crossing &a = loop[k], &b = loop[k + 1 < kCases[cell.number].loop_length ? k + 1 : 0];
        return sharp(a, b) && face_corner(a, b, axis, cell.lower, margin_, corner);
    }

    static uint8_t ends(const Cell& cell, const Vec3& point, int axis) {
        int octant = 0;
        for (int k = 0; k < 3; ++k) octant |= int(point[k] - cell.lower[k] > 0.5) << k;
        return kEnds[axis][cell.number][octant];
    }

    // Keeps the corners between two cells with tips, and numbers them.
    void choose(size_t i) {
        Features& own = features(i);
        if (!own.count) return;
        const Feature* from = own.points;
        Feature* to = own.points;
        for (int axis = 0; axis < 3; ++axis) {
            const Features* below = beside(i, axis, -1);
            Signs none{}, before = below ? below->tips : none;
            for (int x = 0; x < kSide; ++x) {
                Slab tips = own.tips[x], other = axis == 0   ? (x ? own.tips[x - 1] : before[kSide - 1])
                                                 : axis == 1 ? from_y(tips, before[x])
                                                             : from_z(tips, before[x]);
                for (Slab bits = own.corners[axis][x]; bits; bits &= bits - 1, ++from) {
                    if (bits & -bits & other) *to++ = *from;
                }
                own.corners[axis][x] &= other;
                own.rank[axis][x] = uint16_t(own.corner_base);
                own.corner_base += size_t(popcount(own.corners[axis][x]));
            }
        }
        to = std::copy(from, const_cast<const Feature*>(own.points + own.count), to);
        own.count = uint32_t(to - own.points);
    }

    // A corner makes one more triangle in both of its cells.
    void count(size_t i) {
        Features& own = features(i);
        own.triangles = own.loops + own.corner_base;
        own.tip_base = own.count - own.corner_base;
        if (!own.count) return;
        for (int axis = 0; axis < 3; ++axis) {
            const Features* above = beside(i, axis, 1);
            Signs none{}, after = above ? above->corners[axis] : none;
            for (int x = 0; x < kSide; ++x) {
                Slab corners = own.corners[axis][x], upper = axis == 0   ? (x + 1 < kSide ? own.corners[0][x + 1] : after[0])
                                                     : axis == 1 ? shift_y(corners, after[x])
                                                                 : shift_z(corners, after[x]);
                own.triangles += size_t(popcount(upper & own.tips[x]));
            }
        }
    }

    void put(size_t vertex, const Vec3& p) {
        for (int k = 0; k < 3; ++k) {
            result_.vertices.data[3 * vertex + k] = placement_.origin[k] + placement_.voxel * p[k];
        }
    }

    void put(size_t vertex, const Feature& feature) {
        put(vertex, feature.point);
        result_.ends.data[vertex - result_.crossings] = feature.ends;
    }

    void write_vertices(size_t i) {
        cells_.for_each_own_edge(i, [&](const CellEdge& edge) {
            Vec3 point = {double(edge.lower[0]), double(edge.lower[1]), double(edge.lower[2])};
            point[edge.axis] += root(edge.vertex);
            put(edge.vertex - first_vertex_, point);
        });
        const Features& own = features(i);
        size_t corners = corners_of_brick(own), at = result_.crossings + own.corner_base;
        for (size_t k = 0; k < corners; ++k) put(at++, own.points[k]);
    }

    static size_t corners_of_brick(const Features& own) {
        return size_t(own.rank[2][kSide - 1] + popcount(own.corners[2][kSide - 1]));
    }

    void write_triangles(size_t i) {
        const Features& own = features(i);
        int32_t* out = result_.triangles.data.get() + 3 * own.triangles;
        Near near(cells_, i);
        cells_.collect(near.octant, near.numbers);
        size_t tip = result_.crossings + result_.corners + own.tip_base;
        for (size_t k = corners_of_brick(own), at = tip; k < own.count; ++k) put(at++, own.points[k]);
        std::array<const Features*, 3> above{};
        if (own.count) above = {beside(i, 0, 1), beside(i, 1, 1), beside(i, 2, 1)};
        for_each(near, i, [&](const Cell& cell) {
            if (own.tips[cell.x] & cell.bit()) {
                out = write_fan(own, above, cell, tip++, out);
                return;
            }
            const Case& type = kCases[cell.number];
            for (int k = 0; k < 3 * type.triangles; ++k) *out++ = int32_t(cell.at(type.corners[k]) - first_vertex_);
        });
    }

    // The number of the corner in a face (axis*2 + upper) of a cell; -1 if there is none.
    int64_t corner(const Features& own, const std::array<const Features*, 3>& above, const Cell& cell, int face) const {
        int axis = face / 2, at[3] = {cell.x, cell.y, cell.z};
        const Features* owner = &own;
        if (face % 2 && ++at[axis] == kSide) at[axis] = 0, owner = above[axis];
        if (!owner) return -1;
        Slab corners = owner->corners[axis][at[0]], bit = Slab(1) << (at[1] * 8 + at[2]);
        if (!(corners & bit)) return -1;
        return int64_t(result_.crossings + owner->corner_base + owner->rank[axis][at[0]]) + popcount(corners & (bit - 1));
    }

    int32_t* write_fan(const Features& own, const std::array<const Features*, 3>& above, const Cell& cell, size_t tip,
                       int32_t* out) const {
        auto triangle = [&](size_t a, size_t b) {
            *out++ = int32_t(a), *out++ = int32_t(b), *out++ = int32_t(tip);
        };
        const Case& type = kCases[cell.number];
        for (int k = 0; k < type.loop_length; ++k) {
            size_t a = cell.at(type.loop[k]) - first_vertex_;
            size_t b = cell.at(type.loop[k + 1 < type.loop_length ? k + 1 : 0]) - first_vertex_;
            int64_t between = corner(own, above, cell, kFaces[cell.number].after[k]);
            if (between < 0) {
                triangle(a, b);
                continue;
            }
            triangle(a, size_t(between)), triangle(size_t(between), b);
        }
        return out;
    }

    const CellGrid& cells_;
    Layers layers_;
    Span near_;
    Hermite data_;
    Placement placement_;
    double margin_;
    size_t first_datum_, first_vertex_;
    std::vector<Features> features_;
    tbb::enumerable_thread_specific<Store> stores_;
    Contour result_{};
};

}  // namespace

CrossedEdges crossed_edges(const CellGrid& cells, Layers layers) {
    Span span = cells.span(layers);
    size_t first = cells.crossings_before(layers.first), count = cells.crossings_before(layers.last) - first;
    CrossedEdges found{{count, 3}, {count, 1}};
    tbb::parallel_for(span.row, span.row + span.rows, [&](size_t i) {
        cells.for_each_own_edge(i, [&](const CellEdge& edge) {
            size_t at = edge.vertex - first;
            for (size_t k = 0; k < 3; ++k) found.lower.data[k * count + at] = edge.lower[k];
            found.axis.data[at] = edge.axis;
        });
    });
    return found;
}

Contour contour(const CellGrid& cells, Layers layers, const Hermite& data, const Placement& placement) {
    return Contouring(cells, layers, data, placement).run();
}

}  // namespace fracslice
