// Where exactly the surface crosses the grid's edges, and its normals there.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "../volume/field_values.h"
#include "cells.h"

// Segments on which a field has roots, as the loops of fracslice.mesh.root_loops take them.
namespace fracslice::mesh {

// A loop of fracslice.mesh.root_loops over n segments, a multiple of the lanes; `find` writes roots as fractions of them.
template <class Real>
using SegmentLoop = std::function<void(const Real* segments, Real* out, size_t n)>;

constexpr size_t kRows = 6;  // of a segment

// Some segments and their results; one per thread.
template <class Real>
struct Segments {
    std::vector<Real> rows, out;
    size_t count = 0, whole = 0;  // without and with those that fill the last lanes

    void resize(size_t n, size_t lanes) {
        count = n, whole = (n + lanes - 1) / lanes * lanes;
        rows.resize(kRows * whole);
        out.resize(5 * whole);
    }

    void pad() {
        for (size_t k = 0; k < kRows; ++k) {
            std::fill(&rows[k * whole] + count, &rows[k * whole] + whole, rows[k * whole + count - 1]);
        }
    }

    template <class From>
    void convert(const Segments<From>& from, size_t lanes) {
        resize(from.count, lanes);
        std::copy(from.rows.begin(), from.rows.end(), rows.begin());
    }

    // Takes some of others.
    void take(const Segments& from, const std::vector<uint32_t>& which, size_t lanes) {
        resize(which.size(), lanes);
        for (size_t k = 0; k < kRows; ++k) {
            for (size_t i = 0; i < count; ++i) rows[k * whole + i] = from.rows[k * from.whole + which[i]];
        }
        pad();
    }
};

// The loops of fracslice.mesh.root_loops over one field, on arrays of n segments, a multiple of `lanes`, that follow each
// other in one array; the field itself; and how many segments are worth a call.
struct RootLoops {
    size_t lanes, batch;
    SegmentLoop<float> guess;
    SegmentLoop<double> find;
    SegmentLoop<double> polish;  // out: roots, normals, how far they moved
    volume::FieldValues field;
    double sure;  // a root is exact where it moved less
};

// The crossings `begin` to `end` - 1, of whole bricks: where on their edges they are, and the surface's unit normals there, in
// rows of `stride` numbers. Roots are looked for by the fast field and made exact by the other one, from its own signs where
// that one's misled; where that field does not change its sign, the root is the end nearer to zero. In a brick where a plane
// is across the edges only its first crossing is looked for: the field, a little beside the others, says that they are in it.
void find_crossings(const CellGrid& cells, const RootLoops& loops, size_t begin, size_t end,
                    const std::array<double, 3>& origin, double voxel, double* t, float* normals, size_t stride);

// --- Vertices that lie on no grid edge are projected to the surface.

// Loops of fracslice.mesh.root_loops over one field, and the field itself.
struct ProjectionLoops {
    size_t lanes;
    SegmentLoop<float> lead;  // from regions to directions
    SegmentLoop<float> guess;
    SegmentLoop<double> find;
    SegmentLoop<double> aim;  // refines roots; behind them |f| in voxels
    volume::FieldValues field;
};

// For some points, inside or not: rows of `which.size()` numbers: the low and the high corner of the box that each must not
// leave, a point of the other sign and one in the middle of the surface, or NaN.
using TrustRegions = std::function<void(std::span<const int64_t> which, const bool* inside, double* out)>;

// Projects points `first` to `last` - 1, rows of three, to the zero set within their boxes. A point that would come no nearer
// stays.
void project(double* points, size_t first, size_t last, const ProjectionLoops& loops, const TrustRegions& regions, double voxel);

}  // namespace fracslice::mesh
