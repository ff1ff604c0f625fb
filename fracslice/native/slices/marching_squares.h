// Marching squares on the tiles of one layer: coverage of pixels, and crossings linked to contours.
//
// A pixel is the cell between four samples. Corners and edges are counted counter-clockwise from the lower left corner and the
// lower edge; edge c lies between the corners c and c + 1.
#pragma once

#include <array>
#include <vector>

#include "slab.h"

namespace fracslice::slices {

// A picture to paint on: pixel (row, column) at data[row * down + column * across].
struct Canvas {
    uint8_t* data;
    int rows, columns;
    ptrdiff_t down, across;
};

struct Painted {
    double area;     // inside, in pixels
    int64_t partly;  // pixels that the contour cuts
};

// Writes how much of each pixel of a layer is inside, 255 wholly; pixels wholly outside are left as they are.
Painted paint(const Slab& slab, const Canvas& canvas);

// Pixels that are solid, from half of them inside on, as runs: row y has those from rows[y] to before rows[y + 1].
struct SolidRuns {
    std::vector<int32_t> rows;
    std::vector<std::array<int32_t, 2>> runs;  // first pixel, and the one after the last
    Painted painted;
};

SolidRuns solid_runs(const Slab& slab, int rows, int columns);

// A crossed edge of the lattice.
struct Crossing {
    int32_t column, row, up;  // of its first end, and its direction
    int32_t following;        // the crossing that is next on the contour, the inside to the left
};

struct Crossings {
    std::vector<Crossing> edges;
    std::vector<double> ends;  // [n, 2], the values at both ends
};

Crossings crossings(const Slab& slab);

}  // namespace fracslice::slices
