// Passes over the bricks, each brick by itself: which cells and faces have features; how many, and how many triangles; then
// vertices and triangles at the places that the sums of the counts give.
#include "contour.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "cells.h"

namespace fracslice {
namespace {

// The features of a brick's cells: bit y*8 + z of slab x for each cell with a tip, and for its lower face along each axis.
struct Features {
    Signs tips{};
    std::array<Signs, 3> corners{};
    std::array<std::array<uint16_t, kSide>, 3> rank{};  // corners of this brick before that slab
    std::vector<Vec3> points;                           // the tips, in the order of their cells
    std::array<std::vector<Vec3>, 3> corner_points;     // the corners by axis, in the order of their cells
    size_t tip_base = 0, corner_base = 0, triangles = 0;
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

// The faces that a case's loop passes, one after each crossing, and which of them it passes more than once.
struct Faces {
    std::array<int8_t, sizeof(Case::loop)> after{};
    uint8_t twice = 0;
};

constexpr std::array<Faces, 256> make_faces() {
    std::array<Faces, 256> faces{};
    for (int c = 0; c < 256; ++c) {
        int count = kCases[c].loop_length, seen = 0;
        for (int k = 0; k < count; ++k) {
            int face = common_face(kCases[c].loop[k], kCases[c].loop[(k + 1) % count]);
            faces[c].after[k] = int8_t(face);
            faces[c].twice |= uint8_t(seen & 1 << face);
            seen |= 1 << face;
        }
    }
    return faces;
}
constexpr std::array<Faces, 256> kFaces = make_faces();

// A brick with what the cells in it look at.
struct Near {
    Octant octant;
    std::array<Corners, kSide + 1> corners;
    Numbers numbers;

    Near(const CellGrid& cells, size_t i) : octant(cells.octant(i)), corners(corners_of(octant, cells.signs())) {
        cells.collect(octant, numbers);
    }
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
        each(near_, [&](size_t i) { find_tips(i); });
        each(numbered, [&](size_t i) { find_corners(i); });
        each(own, [&](size_t i) { count(i); });
        result_.crossings = cells_.crossings_before(layers_.last + 1) - first_vertex_;
        result_.corners = running_sum(features_, &Features::corner_base, "vertices");
        result_.tips = running_sum(features_, &Features::tip_base, "vertices");
        result_.triangles = {running_sum(features_, &Features::triangles, "triangles"), 3};
        size_t total = result_.crossings + result_.corners + result_.tips;
        if (total > kMostElements) throw std::length_error("the surface has more than 2^31 vertices");
        result_.vertices = {total, 3};
        each(numbered, [&](size_t i) { write_vertices(i); });
        each(own, [&](size_t i) { write_triangles(i); });
        return std::move(result_);
    }

  private:
    template <class Do>
    static void each(const Span& span, const Do& act) {
        tbb::parallel_for(size_t(0), span.size(), [&](size_t k) { act(span.brick(k)); });
    }

    Features& features(size_t i) { return features_[near_.place_of(i)]; }
    const Features& features(size_t i) const { return features_[near_.place_of(i)]; }
    size_t vertex(const CellEdge& edge) const { return edge.vertex - first_vertex_; }

    Crossing crossing(const CellEdge& edge) const {
        Crossing c{{double(edge.lower[0]), double(edge.lower[1]), double(edge.lower[2])}, {}};
        size_t datum = edge.vertex - first_datum_;
        c.point[edge.axis] += clamped(data_.t[datum]);
        for (int k = 0; k < 3; ++k) c.normal[k] = data_.normals[3 * datum + k];
        return c;
    }

    double clamped(double t) const { return t > margin_ ? (t < 1 - margin_ ? t : 1 - margin_) : margin_; }

    Crossing crossing(const Near& near, const Place& place, int x, int y, int z, int e) const {
        return crossing(CellGrid::edge(near.numbers, place, x, y, z, e));
    }

    void find_tips(size_t i) {
        const Near near(cells_, i);
        const Place& place = cells_.place(i);
        for_each_cell(near.corners, [&](int x, int y, int z, uint8_t number) {
            const Case& cell = kCases[number];
            std::array<Crossing, sizeof(Case::loop)> loop;
            bool bent = false;
            for (int a = 0; a < cell.loop_length; ++a) {
                loop[a] = crossing(near, place, x, y, z, cell.loop[a]);
                for (int b = 0; b < a; ++b) bent |= sharp(loop[a], loop[b]);
            }
            Vec3 tip;
            if (!bent || !feature_point(loop.data(), cell.loop_length, lower_corner(place, x, y, z), margin_, tip)) return;
            features(i).tips[x] |= Slab(1) << (y * 8 + z);
            features(i).points.push_back(tip);
        });
    }

    // Whether the cell at these coordinates, relative to brick i, has a tip; it may lie in a neighbour.
    bool has_tip(size_t i, int x, int y, int z) const {
        int64_t at = x >= 0 && y >= 0 && z >= 0 ? int64_t(i) : cells_.find(cells_.place(i), x, y, z);
        return at >= 0 && features(size_t(at)).tips[x & 7] >> ((y & 7) * 8 + (z & 7)) & 1;
    }

    struct Corner {
        const Features* owner = nullptr;  // of the brick that numbers it; null if there is none
        int axis = 0, x = 0, bit = 0;
    };

    // The corner in a face (axis*2 + upper) of the cell x, y, z of a brick.
    Corner corner(size_t i, int x, int y, int z, int face) const {
        int axis = face / 2, up = face % 2;
        x += axis == 0 ? up : 0, y += axis == 1 ? up : 0, z += axis == 2 ? up : 0;
        int64_t at = x < kSide && y < kSide && z < kSide ? int64_t(i) : cells_.find(cells_.place(i), x, y, z);
        if (at < 0) return {};
        const Features& owner = features(size_t(at));
        int bit = (y & 7) * 8 + (z & 7);
        if (!(owner.corners[axis][x & 7] >> bit & 1)) return {};
        return {&owner, axis, x & 7, bit};
    }

    size_t vertex(const Corner& c) const {
        Slab before = c.owner->corners[c.axis][c.x] & ((Slab(1) << c.bit) - 1);
        return result_.crossings + c.owner->corner_base + c.owner->rank[c.axis][c.x] + size_t(__builtin_popcountll(before));
    }

    template <class Visit>
    void for_each_tip(const Near& near, size_t i, const Visit& visit) const {
        const Signs& tips = features(i).tips;
        for (int x = 0; x < kSide; ++x) {
            for (Slab bits = tips[x]; bits; bits &= bits - 1) {
                int y = __builtin_ctzll(bits) / 8, z = __builtin_ctzll(bits) % 8;
                visit(x, y, z, uint8_t(cases_of_row(near.corners[x], near.corners[x + 1], y) >> 8 * z));
            }
        }
    }

    // The corner of the trace in a cell's lower face along `axis`, if there is one. A face that the loop passes twice has
    // none: two could cross.
    bool corner_in(const Near& near, const Place& place, int x, int y, int z, uint8_t number, int axis, Vec3& corner) const {
        const Case& cell = kCases[number];
        const Faces& faces = kFaces[number];
        if (faces.twice >> 2 * axis & 1) return false;
        for (int k = 0; k < cell.loop_length; ++k) {
            if (faces.after[k] != 2 * axis) continue;
            Crossing a = crossing(near, place, x, y, z, cell.loop[k]);
            Crossing b = crossing(near, place, x, y, z, cell.loop[(k + 1) % cell.loop_length]);
            return sharp(a, b) && face_corner(a, b, axis, lower_corner(place, x, y, z), margin_, corner);
        }
        return false;
    }

    static Vec3 lower_corner(const Place& place, int x, int y, int z) {
        return {double(place[0] * kSide + x), double(place[1] * kSide + y), double(place[2] * kSide + z)};
    }

    void find_corners(size_t i) {
        const Near near(cells_, i);
        for_each_tip(near, i, [&](int x, int y, int z, uint8_t number) {
            for (int axis = 0; axis < 3; ++axis) {
                Vec3 corner;
                if (!has_tip(i, x - (axis == 0), y - (axis == 1), z - (axis == 2))) continue;
                if (!corner_in(near, cells_.place(i), x, y, z, number, axis, corner)) continue;
                features(i).corners[axis][x] |= Slab(1) << (y * 8 + z);
                features(i).corner_points[axis].push_back(corner);
            }
        });
        number_corners(features(i));
    }

    static void number_corners(Features& own) {
        for (int axis = 0; axis < 3; ++axis) {
            for (int x = 0; x < kSide; ++x) {
                own.rank[axis][x] = uint16_t(own.corner_base);
                own.corner_base += size_t(__builtin_popcountll(own.corners[axis][x]));
            }
        }
    }

    void count(size_t i) {
        Features& own = features(i);
        own.tip_base = own.points.size();
        for_each_cell(corners_of(cells_.octant(i), cells_.signs()), [&](int x, int y, int z, uint8_t number) {
            if (!(own.tips[x] >> (y * 8 + z) & 1)) {
                own.triangles += kCases[number].triangles;
                return;
            }
            own.triangles += kCases[number].loop_length;
            for (int face = 0; face < 6; ++face) own.triangles += corner(i, x, y, z, face).owner != nullptr;
        });
    }

    void put(size_t vertex, const Vec3& p) {
        for (int k = 0; k < 3; ++k) {
            result_.vertices.data[3 * vertex + k] = placement_.origin[k] + placement_.voxel * p[k];
        }
    }

    void write_vertices(size_t i) {
        const Features& own = features(i);
        cells_.for_each_own_edge(i, [&](const CellEdge& edge) { put(vertex(edge), crossing(edge).point); });
        size_t at = result_.crossings + own.corner_base;
        for (const auto& points : own.corner_points) {
            for (const Vec3& point : points) put(at++, point);
        }
    }

    void write_triangles(size_t i) {
        const Features& own = features(i);
        int32_t* out = result_.triangles.data.get() + 3 * own.triangles;
        const Near near(cells_, i);
        size_t tip = result_.crossings + result_.corners + own.tip_base;
        for (size_t k = 0; k < own.points.size(); ++k) put(tip + k, own.points[k]);
        for_each_cell(near.corners, [&](int x, int y, int z, uint8_t number) {
            auto at = [&](int e) {
                const Edge& edge = kEdges[e];
                return near.numbers[number_at(edge.axis, x + edge.dx, y + edge.dy, z + edge.dz)] - first_vertex_;
            };
            if (own.tips[x] >> (y * 8 + z) & 1) {
                out = write_fan(i, x, y, z, number, at, tip++, out);
                return;
            }
            const Case& cell = kCases[number];
            for (int k = 0; k < 3 * cell.triangles; ++k) *out++ = int32_t(at(cell.corners[k]));
        });
    }

    template <class VertexAt>
    int32_t* write_fan(size_t i, int x, int y, int z, uint8_t number, const VertexAt& at, size_t tip, int32_t* out) const {
        auto triangle = [&](size_t a, size_t b) {
            *out++ = int32_t(a), *out++ = int32_t(b), *out++ = int32_t(tip);
        };
        const Case& cell = kCases[number];
        for (int k = 0; k < cell.loop_length; ++k) {
            size_t a = at(cell.loop[k]), b = at(cell.loop[(k + 1) % cell.loop_length]);
            Corner between = corner(i, x, y, z, kFaces[number].after[k]);
            if (!between.owner) {
                triangle(a, b);
                continue;
            }
            size_t c = vertex(between);
            triangle(a, c), triangle(c, b);
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
            std::copy(edge.lower.begin(), edge.lower.end(), &found.lower.data[3 * at]);
            found.axis.data[at] = edge.axis;
        });
    });
    return found;
}

Contour contour(const CellGrid& cells, Layers layers, const Hermite& data, const Placement& placement) {
    return Contouring(cells, layers, data, placement).run();
}

}  // namespace fracslice
