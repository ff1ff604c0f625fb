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
int common_face(int e, int f) {
    const Edge &a = kEdges[e], &b = kEdges[f];
    const int pa[3] = {a.dx, a.dy, a.dz}, pb[3] = {b.dx, b.dy, b.dz};
    for (int axis = 0; axis < 3; ++axis) {
        if (axis != a.axis && axis != b.axis && pa[axis] == pb[axis]) return 2 * axis + pa[axis];
    }
    return -1;
}

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

    // A cell's loop of crossings, where it has exactly one.
    struct Loop {
        int count = 0;
        const uint8_t* edges = nullptr;
        std::array<CellEdge, 12> where;
        std::array<Crossing, 12> at;
    };

    Loop loop(const Octant& near, const Place& place, int x, int y, int z, uint8_t number) const {
        Loop found;
        found.count = kCases[number].loop_length;
        found.edges = kCases[number].loop;
        for (int k = 0; k < found.count; ++k) {
            found.where[k] = cells_.edge(near, place, x, y, z, found.edges[k]);
            found.at[k] = crossing(found.where[k]);
        }
        return found;
    }

    void find_tips(size_t i) {
        Octant near = cells_.octant(i);
        for_each_cell(corners_of(near, cells_.signs()), [&](int x, int y, int z, uint8_t number) {
            Loop found = loop(near, cells_.place(i), x, y, z, number);
            bool bent = false;
            for (int a = 0; a < found.count; ++a) {
                for (int b = a + 1; b < found.count; ++b) bent |= sharp(found.at[a], found.at[b]);
            }
            Vec3 tip, lower = lower_corner(cells_.place(i), x, y, z);
            if (!bent || !feature_point(found.at.data(), found.count, lower, margin_, tip)) return;
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
    void for_each_tip(size_t i, const Visit& visit) const {
        const Signs& tips = features(i).tips;
        Octant near = cells_.octant(i);
        auto corners = corners_of(near, cells_.signs());
        for (int x = 0; x < kSide; ++x) {
            for (Slab bits = tips[x]; bits; bits &= bits - 1) {
                int y = __builtin_ctzll(bits) / 8, z = __builtin_ctzll(bits) % 8;
                uint8_t number = uint8_t(cases_of_row(corners[x], corners[x + 1], y) >> 8 * z);
                visit(x, y, z, loop(near, cells_.place(i), x, y, z, number));
            }
        }
    }

    // The crossings k and k + 1 of a loop that are joined in its lower face along `axis`, if they have a corner there.
    bool corner_in(const Loop& found, const Place& place, int x, int y, int z, int axis, Vec3& corner) const {
        Vec3 lower = lower_corner(place, x, y, z);
        for (int k = 0; k < found.count; ++k) {
            int next = (k + 1) % found.count;
            if (common_face(found.edges[k], found.edges[next]) != 2 * axis) continue;
            const Crossing &a = found.at[k], &b = found.at[next];
            if (sharp(a, b) && face_corner(a, b, axis, lower, margin_, corner)) return true;
        }
        return false;
    }

    static Vec3 lower_corner(const Place& place, int x, int y, int z) {
        return {double(place[0] * kSide + x), double(place[1] * kSide + y), double(place[2] * kSide + z)};
    }

    void find_corners(size_t i) {
        for_each_tip(i, [&](int x, int y, int z, const Loop& found) {
            for (int axis = 0; axis < 3; ++axis) {
                Vec3 corner;
                if (!has_tip(i, x - (axis == 0), y - (axis == 1), z - (axis == 2))) continue;
                if (twice_in(found, 2 * axis) || !corner_in(found, cells_.place(i), x, y, z, axis, corner)) continue;
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

    // Whether the loop passes a face two times: then its corners could cross.
    static bool twice_in(const Loop& found, int face) {
        int times = 0;
        for (int k = 0; k < found.count; ++k) {
            times += common_face(found.edges[k], found.edges[(k + 1) % found.count]) == face;
        }
        return times > 1;
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
        Octant near = cells_.octant(i);
        const Place& place = cells_.place(i);
        size_t tip = result_.crossings + result_.corners + own.tip_base;
        for (size_t k = 0; k < own.points.size(); ++k) put(tip + k, own.points[k]);
        for_each_cell(corners_of(near, cells_.signs()), [&](int x, int y, int z, uint8_t number) {
            if (!(own.tips[x] >> (y * 8 + z) & 1)) {
                const Case& cell = kCases[number];
                for (int k = 0; k < 3 * cell.triangles; ++k) {
                    *out++ = int32_t(vertex(cells_.edge(near, place, x, y, z, cell.corners[k])));
                }
                return;
            }
            out = write_fan(i, x, y, z, loop(near, place, x, y, z, number), tip++, out);
        });
    }

    int32_t* write_fan(size_t i, int x, int y, int z, const Loop& found, size_t tip, int32_t* out) const {
        auto triangle = [&](size_t a, size_t b) {
            *out++ = int32_t(a), *out++ = int32_t(b), *out++ = int32_t(tip);
        };
        for (int k = 0; k < found.count; ++k) {
            int next = (k + 1) % found.count, face = common_face(found.edges[k], found.edges[next]);
            size_t a = vertex(found.where[k]), b = vertex(found.where[next]);
            Corner between = corner(i, x, y, z, face);
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
