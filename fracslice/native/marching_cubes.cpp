// Two passes over the bricks, each brick by itself: counts, then vertices and triangles at the places that the sums of the
// counts give. Empty cells cost nothing: a word holds 64 of them.
#include "marching_cubes.h"

#include <tbb/parallel_for.h>

#include "cells.h"

namespace fracslice {
namespace {

class Extraction {
  public:
    Extraction(const Bricks& bricks, const Placement& placement) : cells_(bricks), placement_(placement) {}

    Surface run() {
        std::vector<Count> counts(cells_.size());
        tbb::parallel_for(size_t(0), cells_.size(), [&](size_t i) {
            size_t& total = counts[i].triangles;
            for_each_cell(corners_of(cells_.octant(i), cells_.signs()),
                          [&](int, int, int, uint8_t number) { total += kCases[number].triangles; });
        });
        surface_.triangles = {running_sum(counts, &Count::triangles, "triangles"), 3};
        surface_.vertices = {cells_.vertices(), 3};
        surface_.lower = {cells_.vertices(), 3};
        surface_.axis = {cells_.vertices(), 1};
        tbb::parallel_for(size_t(0), cells_.size(), [&](size_t i) {
            Octant near = cells_.octant(i);
            cells_.for_each_own_edge(i, [&](const CellEdge& edge) { write_vertex(i, near, edge); });
            write_triangles(i, near, surface_.triangles.data.get() + 3 * counts[i].triangles);
        });
        return std::move(surface_);
    }

  private:
    struct Count {
        size_t triangles = 0;
    };

    void write_vertex(size_t row, const Octant& near, const CellEdge& edge) {
        const Bricks& bricks = cells_.bricks();
        std::array<int, 3> p, next;
        for (int k = 0; k < 3; ++k) p[k] = next[k] = edge.lower[k] - bricks.ijk[3 * row + k];
        bool leaves = ++next[edge.axis] == kSide;
        if (leaves) next[edge.axis] = 0;
        double a = value(row, p), b = value(leaves ? size_t(near.rows[1 << edge.axis]) : row, next);
        double t = a / (a - b), low = placement_.clamp, high = 1 - low;
        t = t > low ? (t < high ? t : high) : low;
        for (int k = 0; k < 3; ++k) {
            double grid = edge.lower[k] + (k == edge.axis ? t : 0);
            surface_.lower.data[3 * size_t(edge.vertex) + k] = edge.lower[k];
            surface_.vertices.data[3 * size_t(edge.vertex) + k] = placement_.origin[k] + placement_.voxel * grid;
        }
        surface_.axis.data[edge.vertex] = edge.axis;
    }

    double value(size_t row, const std::array<int, 3>& p) const {
        return cells_.bricks().values[row * kSamples + size_t(p[0] * 64 + p[1] * 8 + p[2])];
    }

    void write_triangles(size_t i, const Octant& near, int32_t* out) const;

    CellGrid cells_;
    Placement placement_;
    Surface surface_;
};

void Extraction::write_triangles(size_t i, const Octant& near, int32_t* out) const {
    for_each_cell(corners_of(cells_.octant(i), cells_.signs()), [&](int x, int y, int z, uint8_t number) {
        const Case& cell = kCases[number];
        uint32_t vertex[12];
        for (unsigned edges = cell.edges; edges; edges &= edges - 1) {
            int e = __builtin_ctz(edges);
            vertex[e] = cells_.vertex(near, x, y, z, e);
        }
        for (int k = 0; k < 3 * cell.triangles; ++k) *out++ = int32_t(vertex[cell.corners[k]]);
    });
}

}  // namespace

Surface marching_cubes(const Bricks& bricks, const Placement& placement) {
    check(bricks);
    return Extraction(bricks, placement).run();
}

}  // namespace fracslice
