// Layer by layer, so that features are used while they are in the cache: the features of the next layer are computed and
// its corners numbered, then a layer's tips, vertices and triangles, each brick by itself, at the places that the sums of the
// counts give.

#include "contour.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <string>
#include <utility>

#include "cells.h"

// Two passes over the bricks, each brick by itself: counts, then vertices and triangles at the places that the sums of the
// counts give. Empty cells cost nothing: a word holds 64 of them.

namespace fracslice::mesh {
namespace {

// The case table with, for each corner of a triangle, where Numbers holds it for the cell at 0, 0, 0.
struct Pattern {
    uint8_t triangles;
    std::array<uint16_t, sizeof(Case::corners)> corners;
};

constexpr std::array<Pattern, 256> make_patterns() {
    std::array<Pattern, 256> patterns{};
    for (int c = 0; c < 256; ++c) {
        patterns[c].triangles = kCases[c].triangles;
        for (int k = 0; k < 3 * kCases[c].triangles; ++k) {
            const Edge& edge = kEdges[kCases[c].corners[k]];
            patterns[c].corners[k] = uint16_t(number_at(edge.axis, edge.dx, edge.dy, edge.dz));
        }
    }
    return patterns;
}
constexpr std::array<Pattern, 256> kPatterns = make_patterns();

class Extraction {
  public:
    Extraction(const Bricks& bricks, const Placement& placement)
        : bricks_(bricks), cells_(bricks, volume::signs_of(bricks)), placement_(placement) {}

    Surface run() {
        std::vector<Count> counts(cells_.size());
        tbb::parallel_for(size_t(0), cells_.size(), [&](size_t i) {
            size_t& total = counts[i].triangles;
            for_each_cell(corners_of(cells_.octant(i), cells_.signs()),
                          [&](int, int, int, uint8_t number) { total += kPatterns[number].triangles; });
        });
        surface_.triangles = {running_sum(counts, &Count::triangles, "triangles"), 3};
        surface_.vertices = {cells_.vertices(), 3};
        tbb::parallel_for(size_t(0), cells_.size(), [&](size_t i) {
            Octant near = cells_.octant(i);
            if (i < cells_.sampled()) write_vertices(i, near);
            write_triangles(near, surface_.triangles.data.get() + 3 * counts[i].triangles);
        });
        return std::move(surface_);
    }

  private:
    struct Count {
        size_t triangles = 0;
    };

    void write_vertices(size_t row, const Octant& near) {
        const float* values = bricks_.values + row * kSamples;
        cells_.for_each_own_edge(row, [&](const CellEdge& edge) {
            int at = 0, step = 64 >> 3 * edge.axis;
            for (int k = 0; k < 3; ++k) at = at * kSide + (edge.lower[k] - bricks_.ijk[3 * row + k]);
            bool leaves = (at / step) % kSide == kSide - 1;
            const float* other = leaves ? bricks_.values + size_t(near.rows[1 << edge.axis]) * kSamples : values;
            write_vertex(edge, crossing(values[at], other[at + (leaves ? 1 - kSide : 1) * step]));
        });
    }

    double crossing(double a, double b) const {
        double t = a / (a - b), low = placement_.minimum_edge_parameter, high = 1 - low;
        return t > low ? (t < high ? t : high) : low;
    }

    void write_vertex(const CellEdge& edge, double t) {
        assert(t > 0 && t < 1);  // strictly within its edge: no triangle touches another cell's
        size_t first = 3 * size_t(edge.vertex);
        std::array<double, 3> place = {double(edge.lower[0]), double(edge.lower[1]), double(edge.lower[2])};
        place[edge.axis] += t;
        for (size_t k = 0; k < 3; ++k) {
            surface_.vertices.data[first + k] = placement_.origin[k] + placement_.voxel * place[k];
        }
    }

    void write_triangles(const Octant& near, int32_t* out) const {
        Numbers numbers;
        cells_.collect(near, numbers);
        for_each_cell(corners_of(near, cells_.signs()), [&](int x, int y, int z, uint8_t number) {
            const Pattern& pattern = kPatterns[number];
            const uint32_t* cell = &numbers[number_at(0, x, y, z)];
            for (int k = 0; k < 3 * pattern.triangles; ++k) *out++ = int32_t(cell[pattern.corners[k]]);
        });
    }

    Bricks bricks_;
    CellGrid cells_;
    Placement placement_;
    Surface surface_;
};

}  // namespace

Surface marching_cubes(const Bricks& bricks, const Placement& placement) {
    return Extraction(bricks, placement).run();
}

namespace {

// The corner of a cell, dx + 2 dy + 4 dz, that is fewest edges away from one and not of its sign; in the lower face across
// `face` if that is an axis.
int nearest_corner(unsigned face, unsigned number, unsigned from, bool inside) {
    int best = 0, least = 4;
    for (unsigned corner = 0; corner < 8; ++corner) {
        if ((face < 3 && (corner >> face & 1)) || (number >> corner & 1) == inside) continue;
        int away = std::popcount(corner ^ from);
        if (away < least) best = int(corner), least = away;
    }
    return best;
}

}  // namespace

void trust_regions(const FeatureRows& features, std::span<const int64_t> which, std::span<const bool> inside,
                   const Placement& placement, double* out) {
    assert(which.size() == inside.size());
    const size_t count = which.size();
    double voxel = placement.voxel, margin = placement.minimum_edge_parameter;
    for (size_t i = 0; i < count; ++i) {
        size_t row = size_t(which[i]);
        const double* point = features.points + 3 * row;
        unsigned face = 3, octant = 0;
        bool flat[3];
        double cell[3];
        for (unsigned k = 3; k-- > 0;) {
            double grid = (point[k] - placement.origin[k]) / voxel, whole = std::nearbyint(grid);
            flat[k] = std::abs(grid - whole) < margin / 2;
            cell[k] = flat[k] ? whole : std::floor(grid);
            octant |= unsigned(grid - cell[k] > 0.5) << k;
            if (flat[k]) face = k;
        }
        int corner = nearest_corner(face, features.cases[row], octant, inside[i]);
        for (size_t k = 0; k < 3; ++k) {
            double origin = placement.origin[k], *to = out + k * count + i;
            double low = flat[k] ? point[k] : origin + voxel * (cell[k] + margin);
            double high = flat[k] ? point[k] : origin + voxel * (cell[k] + (1 - margin));
            double middle = point[k] + double(float(voxel) * features.to_means[3 * row + k]);
            to[0] = low, to[3 * count] = high, to[6 * count] = origin + voxel * (cell[k] + (corner >> k & 1));
            to[9 * count] = std::min(std::max(middle, low), high);
        }
    }
}

namespace {

constexpr int64_t kNone = -1;

// The loop of a cell's crossings and corners around its tip, or where it has none around the first corner.
int32_t* write_fan(const Around& around, const Cell& cell, int64_t tip, int32_t* out) {
    const Case& type = kCases[cell.number];
    std::array<int64_t, 2 * sizeof(Case::loop) + 1> loop;
    int count = 0, bit = cell.y * kSide + cell.z;
    for (int k = 0; k < type.loop_length; ++k) {
        loop[count++] = cell.at(type.loop[k]);
        int face = kFaces[cell.number].after[k];
        if (!(around.at(cell.x, face) >> bit & 1)) continue;
        loop[count] = int64_t(around.corner(cell.x, face, bit).vertex());
        if (tip == kNone) tip = loop[count];
        ++count;
    }
    loop[count] = loop[0];
    for (int k = 0; k < count; ++k) {
        if (loop[k] == tip || loop[k + 1] == tip) continue;
        *out++ = int32_t(loop[k]), *out++ = int32_t(loop[k + 1]), *out++ = int32_t(tip);
    }
    return out;
}

// The two triangles of each of some flat cells of plane x.
int32_t* write_flat(const BrickCells& near, int x, BitPlane cells, uint8_t number, int32_t* out) {
    std::array<uint16_t, 6> places;
    for (int k = 0; k < 6; ++k) places[k] = kPlaces[kCases[number].corners[k]];
    for (; cells; cells &= cells - 1) {
        int bit = std::countr_zero(cells);
        const uint32_t* numbers = &near.numbers[number_at(0, x, bit / 8, bit % 8)];
        for (int k = 0; k < 6; ++k) *out++ = int32_t(numbers[places[k]]);
    }
    return out;
}

// How many crossings some layers number.
size_t crossings_of(const CellGrid& cells, Layers layers) {
    return cells.crossings_before(layers.last) - cells.crossings_before(layers.first);
}

// Space for at most these numbers. A crossing is in the loops of four cells. A loop has one tip, no more corners, each shared with
// another loop, than crossings, and twice as many triangles; three crossings at least.
Contour space(size_t crossings, size_t known) {
    Contour space{{crossings + known * 10 / 3, 3}, {8 * known, 3}, {known * 10 / 3, 3}, {known * 10 / 3, 1}, crossings, {}};
    space.triangles.rows = space.cases.rows = 0;
    return space;
}

}  // namespace

Contouring::Contouring(const CellGrid& cells, Layers layers, const Placement& placement)
    : cells_(cells), layers_(layers), placement_(placement), features_(cells, layers), next_(layers.first - 1),
      first_vertex_(cells.crossings_before(layers.first)), known_(crossings_of(cells, {layers.first - 1, layers.last + 2})),
      result_(space(crossings_of(cells, {layers.first, layers.last + 1}), known_)) {}

void Contouring::advance(int end, const Hermite& data) {
    size_t first = cells_.crossings_before(next_), last = cells_.crossings_before(end + 1);
    if (end > layers_.last + 1 || data.first > first || data.first + data.count < last) {
        throw std::invalid_argument("expected the crossings " + std::to_string(first) + " to " + std::to_string(last));
    }
    for (; next_ < end; ++next_) {
        features_.find(next_, data);
        if (next_ < layers_.first) continue;
        features_.choose(next_);
        number_corners(next_);
        for_each_brick(cells_.bricks_of({next_, next_ + 1}), [&](size_t i) { write_vertices(i, data); });
        if (next_ > layers_.first) write_layer(next_ - 1);
    }
}

Contour Contouring::finish() {
    if (next_ <= layers_.last) throw std::invalid_argument("there are layers left");
    result_.vertices.rows = result_.crossings + result_.cases.rows;
    return std::move(result_);
}

// Gives features their places, brick by brick.
void Contouring::number_corners(int layer) {
    LayerBricks bricks = cells_.bricks_of({layer, layer + 1});
    for (size_t k = 0; k < bricks.size(); ++k) {
        Features& own = features_.of(bricks.brick(k));
        for (size_t axis = 0; axis < 3; ++axis) own.corner_base[axis] = numbered(own.counts[axis]);
    }
}

void Contouring::number_tips(int layer) {
    LayerBricks bricks = cells_.bricks_of({layer, layer + 1});
    for (size_t k = 0; k < bricks.size(); ++k) {
        Features& own = features_.of(bricks.brick(k));
        own.tip_base = numbered(own.tip_count);
    }
}

size_t Contouring::numbered(size_t count) {
    size_t first = result_.crossings + result_.cases.rows;
    assert(result_.cases.rows + count <= known_ * 10 / 3);
    if (first + count > kMostElements) throw std::length_error("the surface has more than 2^31 vertices");
    result_.cases.rows += count;
    return first;
}

void Contouring::write_layer(int layer) {
    LayerBricks bricks = cells_.bricks_of({layer, layer + 1});
    features_.straighten(layer);
    number_tips(layer);
    for (size_t k = 0; k < bricks.size(); ++k) {
        size_t& count = features_.of(bricks.brick(k)).triangles;
        count = std::exchange(result_.triangles.rows, result_.triangles.rows + count);
    }
    assert(result_.triangles.rows <= 8 * known_);
    if (result_.triangles.rows > kMostElements) throw std::length_error("the surface has more than 2^31 triangles");
    for_each_brick(bricks, [&](size_t i) { write_triangles(i); });
    put_blunt(layer);
}

void Contouring::put_blunt(int layer) {
    LayerBricks bricks = cells_.bricks_of({layer, layer + 1});
    for (size_t k = 0; k < bricks.size(); ++k) {
        const size_t i = bricks.brick(k);
        const BrickPlace place = cells_.place(i);
        const Signs& blunt = features_.of(i).blunt;
        for (int x = 0; x < kSide; ++x) {
            for (BitPlane bits = blunt[x]; bits; bits &= bits - 1) {
                const int bit = std::countr_zero(bits), at[] = {x, bit / kSide, bit % kSide};
                for (int j = 0; j < 3; ++j) {
                    double middle = double(place[j] * kSide + at[j]) + 0.5;
                    result_.blunt.push_back(placement_.origin[j] + placement_.voxel * middle);
                }
            }
        }
    }
}

void Contouring::put(size_t vertex, const Vec3& point) {
    for (int k = 0; k < 3; ++k) {
        result_.vertices.data[3 * vertex + k] = placement_.origin[k] + placement_.voxel * point[k];
    }
}

void Contouring::put(size_t vertex, const Feature& feature) {
    size_t row = vertex - result_.crossings;
    assert(row < result_.cases.rows);
    put(vertex, feature.point);
    std::copy(feature.to_mean.begin(), feature.to_mean.end(), &result_.to_means.data[3 * row]);
    result_.cases.data[row] = feature.number;
}

void Contouring::write_vertices(size_t i, const Hermite& data) {
    cells_.for_each_own_edge(i, [&](const CellEdge& edge) {
        Vec3 point = {double(edge.lower[0]), double(edge.lower[1]), double(edge.lower[2])};
        point[edge.axis] += data.root(edge.vertex);
        put(edge.vertex - first_vertex_, point);
    });
    const Features& own = features_.of(i);
    for (size_t axis = 0; axis < 3; ++axis) {
        for (size_t k = 0; k < own.counts[axis]; ++k) put(own.corner_base[axis] + k, own.result[axis][k]);
    }
}

void Contouring::write_triangles(size_t i) {
    const Features& own = features_.of(i);
    int32_t* out = result_.triangles.data.get() + 3 * own.triangles;
    BrickCells near(cells_, i);
    cells_.for_each_near(near.octant,
                         [&](size_t at, uint32_t vertex) { near.numbers[at] = uint32_t(vertex - first_vertex_); });
    Around around(features_, i);
    const Feature* feature = own.result[3];
    size_t tip = own.tip_base;
    auto write = [&](const Cell& cell) {
        const Case& type = kCases[cell.number];
        if (!(own.cells[cell.x] & cell.bit())) {
            for (int k = 0; k < 3 * type.triangles; ++k) *out++ = int32_t(cell.at(type.corners[k]));
        } else if (own.straight[cell.x] & cell.bit()) {
            ++feature;
            out = write_fan(around, cell, kNone, out);
        } else {
            put(tip, *feature++);
            out = write_fan(around, cell, int64_t(tip++), out);
        }
    };
    for (int x = 0; x < kSide; ++x) {
        Passed cells(near.corners[x], near.corners[x + 1]);
        BitPlane left = cells.rest;
        for (int k = 0; k < 6; ++k) {
            BitPlane bent = cells.flat[k / 2][k % 2] & own.cells[x];
            left |= bent;
            out = write_flat(near, x, cells.flat[k / 2][k % 2] & ~bent, kFlat[k / 2][k % 2], out);
        }
        near.for_each(x, left, write);
    }
    assert(tip == own.tip_base + own.tip_count);  // as many as were counted, so that no brick writes into another's places
}

}  // namespace fracslice::mesh
