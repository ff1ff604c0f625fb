// Bricks <-> OpenVDB. Included by the grid sources only: OpenVDB's headers are heavy.
//
// Python extensions are built with hidden visibility. OpenVDB's templates hold once-flags and type registries that must be
// the same objects here and in libopenvdb, so its headers need default visibility, or openvdb::initialize() crashes.
#pragma once
#pragma GCC visibility push(default)
#include <openvdb/openvdb.h>
#pragma GCC visibility pop

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "../array.h"
#include "signs.h"

namespace fracslice::volume {

using FloatGrid = openvdb::FloatGrid;
using Metadata = std::map<std::string, std::string>;

struct BrickArrays {
    Array<int32_t> ijk;
    Array<float> values;
    Array<int32_t> index;
    std::array<size_t, 3> size;
    std::array<int32_t, 3> shift;  // grid index of point (0, 0, 0) of the arrays
};

// A level set: active where sampled; the background is the largest sample; unsampled inside bricks are inactive tiles.
FloatGrid::Ptr grid_from_bricks(const Bricks& bricks, const std::array<double, 3>& origin, double voxel);
BrickArrays bricks_from_grid(const FloatGrid& grid);

// Origin and spacing of the grid's points. Throws std::invalid_argument unless the voxels are axis-aligned cubes.
std::pair<std::array<double, 3>, double> placement_of(const FloatGrid& grid);
// True if the axes of the grid are those of space, of either sign and in any order.
bool along_axes(const FloatGrid& grid);

// A grid of dense samples [size[0], size[1], size[2]], with `beyond` around them.
FloatGrid::Ptr grid_from_array(const float* values, const std::array<size_t, 3>& size, const std::array<double, 3>& origin,
                               const std::array<double, 3>& spacing, float beyond);
// The same with voxels that are cubes, of the shortest side; itself if they are. Throws std::invalid_argument for axes that are
// not at right angles, or too many samples.
FloatGrid::Ptr with_cubes(const FloatGrid::Ptr& grid);
// Values minus a number, or that number minus values, with samples in place of active tiles.
FloatGrid::Ptr less(const FloatGrid& grid, float iso, bool turned);
// Of the distances of a narrow band: densities, 1 inside, 0 outside, and 1/2 at the surface, in the middle of a ramp.
FloatGrid::Ptr fog(const FloatGrid& grid);

// Its leaves in the order of their origins.
std::vector<const FloatGrid::TreeType::LeafNodeType*> sorted_leaves(const FloatGrid::TreeType& tree);

// A name with "?" for what is no printable ASCII.
std::string printable(std::string name);

// All three throw std::runtime_error with the path, also for a full disk, which OpenVDB does not report.
void write_grid(const FloatGrid::Ptr& grid, const std::string& path, const Metadata& metadata);
// The grid of a name, or the first one, of numbers or of a mask, which is 1 and 0.
FloatGrid::Ptr read_grid(const std::string& path, const std::string& name);
// Names of all grids.
std::vector<std::string> grids_of(const std::string& path);

// A field that is not a distance, made one in scene units around the same surface (fast sweeping, Zhao 2004).
FloatGrid::Ptr redistance(const FloatGrid& grid);
// The surface moved outwards by `distance` scene units; negative: inwards. The grid must hold distances.
FloatGrid::Ptr offset(const FloatGrid& grid, double distance);

}  // namespace fracslice::volume
