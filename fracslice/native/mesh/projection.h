// Vertices that lie on no grid edge are projected to the surface.
#pragma once
#include <functional>
#include <span>

#include "../volume/field_values.h"
#include "segments.h"

namespace fracslice::mesh {

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
