// Vertices at coordinates that a file can hold, and which of them still lie where the mesher put them.
#pragma once
#include <span>

#include "../array.h"

namespace fracslice::mesh {

// The planes of a grid across the axes, ascending along each; [count, 3].
struct Planes {
    const double* at;
    size_t count;

    double operator()(size_t i, int axis) const { return at[3 * i + size_t(axis)]; }
};

struct Quantised {
    Array<double> points;    // rounded to float32, without negative zeros
    Array<bool> displaced;   // all that are not in the same planes of the grid and strictly between the same ones as before
    bool finite = true;
};

// points: [count, 3]. Without planes all are displaced.
//
// Triangles of vertices that are not displaced are as free of self-intersections as contour.h proves them to be: rounding takes
// all coordinates of a plane to the same number and keeps cells apart, so that corners, crossings and tips stay strictly within
// their faces, edges and cells. It also makes no two such vertices one.
Quantised quantise(const double* points, size_t count, const Planes& planes);

}  // namespace fracslice::mesh
