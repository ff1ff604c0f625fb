// Where edges of a grid cross its surface: what is nearest to a point.
#pragma once
#include <span>
#include <vector>

#include "grid.h"

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

}  // namespace fracslice::volume
