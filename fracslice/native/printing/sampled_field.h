// A sampled field, interpolated between its samples, and rays through it: `fracslice.printing.samples`, `fracslice.printing.walls`.
#pragma once
#include <array>
#include <cmath>
#include <mutex>
#include <span>
#include <vector>

#include "../volume/bricks.h"

namespace fracslice::printing {

using Point = std::array<double, 3>;

// Where the surface crosses grid edges; the unit normals there, and the surface that each represents.
struct Crossings {
    std::vector<Point> points, normals;
    std::vector<double> area;
};

// Start points, and unit vectors.
struct Rays {
    std::span<const Point> start, directions;
};

class SampledField {
  public:
    // The rows of the bricks and their index name each other.
    SampledField(const volume::Bricks& bricks, const Point& origin, double voxel);

    // Value at a point, scene units.
    double value(const Point& p) const { return between(in_voxels(p)); }
    // The same where the samples are distances to capsules less their radius, of which the squares are interpolated.
    double capsule_value(const Point& p, double radius) const;
    // Distances along rays to the first cell with the surface, at most `far`.
    std::vector<double> free(const Rays& rays, std::span<const double> far) const;
    // Distances along rays to where `towards` times the value turns positive; twice the limit if that is farther.
    std::vector<double> through(const Rays& rays, double limit, double towards) const;
    Crossings crossings(std::span<const int64_t> rows) const;
    // Whether some point may be deeper inside than `depth` voxels, where values differ by at most `lipschitz` times a distance.
    bool may_be_deep(double depth, double lipschitz) const;

  private:
    static constexpr int kAround = 11;  // samples along each axis of a brick with one layer before it and two after it
    using Neighbourhood = std::array<float, kAround * kAround * kAround>;

    Point in_voxels(const Point& p) const;
    double between(const Point& place) const;
    double sample(int64_t i, int64_t j, int64_t k) const;
    double bound(int64_t x, int64_t y, int64_t z) const { return bounds_[brick(x, y, z)]; }
    bool within(int64_t x, int64_t y, int64_t z) const {
        return x >= 0 && y >= 0 && z >= 0 && x < bricks_.size[0] && y < bricks_.size[1] && z < bricks_.size[2];
    }
    size_t brick(int64_t x, int64_t y, int64_t z) const {
        return (size_t(x) * size_t(bricks_.size[1]) + size_t(y)) * size_t(bricks_.size[2]) + size_t(z);
    }
    bool is_mixed(const Point& place) const;
    bool is_beside(const Point& place) const;
    void gather(size_t row, Neighbourhood& f) const;
    std::vector<float> brick_bounds() const;
    void find_beside() const;

    volume::Bricks bricks_;
    Point origin_;
    double voxel_;
    std::vector<float> bounds_;  // signed lower bound of the distance to the surface in each unsampled brick
    mutable std::once_flag once_;
    mutable std::vector<uint8_t> beside_;  // samples with the opposite sign among the 26 around them
};

}  // namespace fracslice::printing
