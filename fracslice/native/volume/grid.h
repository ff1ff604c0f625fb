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

#include "../array.h"
#include "bricks.h"

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

// Both throw std::runtime_error with the path, also for a full disk, which OpenVDB does not report.
void write_grid(const FloatGrid::Ptr& grid, const std::string& path, const Metadata& metadata);
FloatGrid::Ptr read_grid(const std::string& path, const std::string& name);

// A field that is not a distance, made one in scene units around the same surface (fast sweeping, Zhao 2004).
FloatGrid::Ptr redistance(const FloatGrid& grid);
// The surface moved outwards by `distance` scene units; negative: inwards. The grid must hold distances.
FloatGrid::Ptr offset(const FloatGrid& grid, double distance);

}  // namespace fracslice::volume
