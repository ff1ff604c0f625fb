// A grid around a surface as machine code asks for it: signed distances of the points of a packet.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "../mesh/distances.h"
#include "grid.h"

// Where edges of a grid cross its surface: what is nearest to a point.

namespace fracslice::volume {

// A point of the surface and the direction in which values rise there, in voxels from sample (0, 0, 0).
struct SurfacePoint {
    openvdb::Vec3d at, up;  // `up` of length 1, or 0
};

class SurfacePoints {
  public:
    explicit SurfacePoints(const FloatGrid::TreeType& tree);

    std::span<const SurfacePoint> all() const { return points_; }
    // Number of the nearest point, the first of several; the search begins with a guess. There is at least one point.
    size_t nearest(const openvdb::Vec3d& q, size_t guess = 0) const;

  private:
    struct Box {
        openvdb::Vec3d low, high;
    };

    void halve(size_t node, std::span<SurfacePoint> points);

    std::vector<SurfacePoint> points_;  // in the order of the leaves
    size_t leaves_ = 1;
    std::vector<Box> boxes_;     // a heap
    std::vector<size_t> first_;  // point of each leaf, and the end
};

// Half the width of the narrow bands that are made here, voxels: that of OpenVDB's own.
constexpr double kBand = 3;

// A narrow band of distances around the surface where numbers of a grid are 0, negative inside. Throws
// std::invalid_argument if there is none, or its inside is without closure.
FloatGrid::Ptr narrow_band(const FloatGrid& grid);

// The grid itself, without what is far from the surface, if its values are distances, negative inside and positive far away:
// their steepest slope is from 1/2 to 2. Else the narrow band of its surface.
FloatGrid::Ptr level_set_of(const FloatGrid& grid);

// Values at most `steepness()` times as far apart as points are, divided by that: near the surface they are those of
// the grid, between samples linear along each axis; beyond, the distance to the nearest point where an edge of the grid
// crosses the surface.
class LevelSet {
  public:
    static constexpr size_t kAxes = 3;

    // Of `level_set_of` a grid. Throws std::invalid_argument if there is no surface.
    explicit LevelSet(const FloatGrid& grid);
    LevelSet(const LevelSet&) = delete;
    LevelSet& operator=(const LevelSet&) = delete;

    const mesh::Distances* entry() const { return &entry_; }
    double operator()(const double* p, size_t& found) const;
    double steepness() const { return steepness_; }
    // Outermost points of the inside along -x, -y, -z, x, y and z. A cell of samples reaches farthest at one of its edges, so they
    // are exact; none if the grid is turned.
    std::optional<std::array<std::array<double, 3>, 6>> tips() const;
    // Corners of the box of the inside.
    std::array<std::array<double, 3>, 2> box() const;

  private:
    double linear(const openvdb::Vec3d& q) const;
    double disagreement() const;
    std::array<std::array<double, 3>, 6> outermost() const;

    FloatGrid::Ptr grid_;
    double voxel_, end_, begin_;  // from value `begin_` to `end_`, linear ones become distances to points
    SurfacePoints points_;
    double steepness_;
    mesh::Distances entry_;
};

}  // namespace fracslice::volume
