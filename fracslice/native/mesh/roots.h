// Where exactly the surface crosses the grid's edges, and its normals there.
#pragma once
#include "../volume/field_values.h"
#include "cells.h"
#include "segments.h"

namespace fracslice::mesh {

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

}  // namespace fracslice::mesh
