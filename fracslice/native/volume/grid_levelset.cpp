#include "grid.h"

#pragma GCC visibility push(default)
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Count.h>
#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/ValueTransformer.h>
#pragma GCC visibility pop

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fracslice::volume {
namespace {

// The background must stay beyond all samples, or inactive points would lie nearer to the surface than active ones.
void fit_background(FloatGrid& grid) {
    auto range = openvdb::tools::minMax(grid.tree());
    double most = std::max(std::fabs(range.min()), std::fabs(range.max()));
    openvdb::tools::changeLevelSetBackground(grid.tree(), float(most));
}

}  // namespace

FloatGrid::Ptr redistance(const FloatGrid& grid) {
    auto distances = openvdb::tools::sdfToSdf(grid);
    if (!distances) throw std::invalid_argument("the grid holds no surface");
    fit_background(*distances);
    return distances;
}

FloatGrid::Ptr offset(const FloatGrid& grid, double distance) {
    // Two voxels beyond the new surface, so that every cell it passes has samples at all corners.
    int reach = int(std::ceil(std::fabs(distance) / grid.voxelSize()[0])) + 2;
    // Only to the side that the surface moves to.
    using openvdb::tools::FastSweepingDomain;
    auto side = distance < 0 ? FastSweepingDomain::SWEEP_LESS_THAN_ISOVALUE : FastSweepingDomain::SWEEP_GREATER_THAN_ISOVALUE;
    auto moved = openvdb::tools::dilateSdf(grid, reach, openvdb::tools::NN_FACE, 1, side);
    if (!moved) throw std::invalid_argument("the grid holds no surface");
    fit_background(*moved);
    float by = float(distance);
    openvdb::tools::foreach(moved->beginValueOn(), [by](const FloatGrid::ValueOnIter& v) { v.setValue(*v - by); });
    fit_background(*moved);
    openvdb::tools::pruneLevelSet(moved->tree());
    return moved;
}

}  // namespace fracslice::volume
