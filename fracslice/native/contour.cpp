// Once the features are known, how many triangles they make; then vertices and triangles, each brick by itself, at the
// places that the sums of the counts give.
#include "contour.h"

#include <algorithm>

#include "faces.h"
#include "features.h"

namespace fracslice {
namespace {

int popcount(Slab bits) { return __builtin_popcountll(bits); }

class Contouring {
  public:
    Contouring(const CellGrid& cells, Layers layers, const Hermite& data, const Placement& placement)
        : cells_(cells), layers_(layers), crossed_(cells, layers, data, placement.clamp),
          features_(cells, layers, crossed_, placement.clamp), placement_(placement),
          first_vertex_(cells.crossings_before(layers.first)) {}

    Contour run() {
        Span own = cells_.span(layers_), numbered = cells_.span({layers_.first, layers_.last + 1});
        for_each_brick(own, [&](size_t i) { count_triangles(i); });
        for_each_brick(numbered, [&](size_t i) { features_.of(i).corner_base = features_.of(i).corner_count; });
        result_.crossings = cells_.crossings_before(layers_.last + 1) - first_vertex_;
        result_.corners = features_.running_sum(&Features::corner_base, "vertices");
        result_.tips = features_.running_sum(&Features::tip_base, "vertices");
        result_.triangles = {features_.running_sum(&Features::triangles, "triangles"), 3};
        size_t total = result_.crossings + result_.corners + result_.tips;
        if (total > kMostElements) throw std::length_error("the surface has more than 2^31 vertices");
        result_.vertices = {total, 3};
        result_.ends = {result_.corners + result_.tips, 1};
        for_each_brick(numbered, [&](size_t i) { write_vertices(i); });
        for_each_brick(own, [&](size_t i) { write_triangles(i); });
        return std::move(result_);
    }

  private:
    // A corner makes one more triangle in both of its cells.
    void count_triangles(size_t i) {
        Features& own = features_.of(i);
        own.triangles = own.loops + own.corner_count;
        own.tip_base = own.count - own.corner_count;
        if (!own.count) return;
        for (int axis = 0; axis < 3; ++axis) {
            const Features* above = features_.beside(i, axis, 1);
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
            point[edge.axis] += crossed_.root(edge.vertex);
            put(edge.vertex - first_vertex_, point);
        });
        const Features& own = features_.of(i);
        size_t corner = result_.crossings + own.corner_base;
        for (size_t k = 0; k < own.corner_count; ++k) put(corner++, own.points[k]);
    }

    void write_triangles(size_t i) {
        const Features& own = features_.of(i);
        int32_t* out = result_.triangles.data.get() + 3 * own.triangles;
        Near near(cells_, i);
        cells_.for_each_near(near.octant,
                             [&](size_t at, uint32_t vertex) { near.numbers[at] = uint32_t(vertex - first_vertex_); });
        size_t tip = result_.crossings + result_.corners + own.tip_base;
        for (size_t k = own.corner_count, at = tip; k < own.count; ++k) put(at++, own.points[k]);
        Above above{};
        if (own.count) above = {features_.beside(i, 0, 1), features_.beside(i, 1, 1), features_.beside(i, 2, 1)};
        near.for_each([&](const Cell& cell) {
            if (own.tips[cell.x] & cell.bit()) {
                out = write_fan(own, above, cell, tip++, out);
                return;
            }
            const Case& type = kCases[cell.number];
            for (int k = 0; k < 3 * type.triangles; ++k) *out++ = int32_t(cell.at(type.corners[k]));
        });
    }

    using Above = std::array<const Features*, 3>;

    // The number of the corner in a face (axis*2 + upper) of a cell; -1 if there is none.
    int64_t corner(const Features& own, const Above& above, const Cell& cell, int face) const {
        int axis = face / 2, at[3] = {cell.x, cell.y, cell.z};
        const Features* owner = &own;
        if (face % 2 && ++at[axis] == kSide) at[axis] = 0, owner = above[axis];
        if (!owner) return -1;
        Slab corners = owner->corners[axis][at[0]], bit = Slab(1) << (at[1] * 8 + at[2]);
        if (!(corners & bit)) return -1;
        return int64_t(result_.crossings + owner->corner_base + owner->rank[axis][at[0]]) + popcount(corners & (bit - 1));
    }

    int32_t* write_fan(const Features& own, const Above& above, const Cell& cell, size_t tip, int32_t* out) const {
        auto triangle = [&](size_t a, size_t b) {
            *out++ = int32_t(a), *out++ = int32_t(b), *out++ = int32_t(tip);
        };
        const Case& type = kCases[cell.number];
        for (int k = 0; k < type.loop_length; ++k) {
            size_t a = cell.at(type.loop[k]), b = cell.at(type.loop[k + 1 < type.loop_length ? k + 1 : 0]);
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
    Crossed crossed_;
    FeatureGrid features_;
    Placement placement_;
    size_t first_vertex_;
    Contour result_{};
};

}  // namespace

Contour contour(const CellGrid& cells, Layers layers, const Hermite& data, const Placement& placement) {
    return Contouring(cells, layers, data, placement).run();
}

}  // namespace fracslice
