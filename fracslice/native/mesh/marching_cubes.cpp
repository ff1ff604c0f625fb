// Two passes over the bricks, each brick by itself: counts, then vertices and triangles at the places that the sums of the
// counts give. Empty cells cost nothing: a word holds 64 of them.
#include "marching_cubes.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <tbb/parallel_for.h>

#include "cells.h"

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

}  // namespace fracslice::mesh
