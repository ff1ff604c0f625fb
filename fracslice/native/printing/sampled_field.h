// A sampled field, interpolated between its samples, and rays through it: `fracslice.printing.walls`, `fracslice.printing.walls`.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "../array.h"
#include "../volume/signs.h"

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

// Components, numbered from 0. Number 0 is the space that extends beyond the samples.
template <class Index>
struct SolidComponents {
    Array<Index> of;             // of the space beyond, of each sample, and of each unsampled brick in the order of the index
    std::vector<int64_t> sizes;  // samples
    std::vector<uint8_t> inside;
};

// Samples are connected along edges of the grid; an unsampled brick is connected as a whole. values: [layout.count, 512].
template <class Index, class Value>
SolidComponents<Index> solid_components(const volume::Layout& layout, const Value* values);

// Grid edges between samples of different signs, each counted for its inside component. labels: of samples, each below `count`.
template <class Index, class Value>
std::vector<int64_t> crossings_by_component(const volume::Layout& layout, const Value* values, const Index* labels, size_t count);

// Start, direction vector and inverse squared length of an axis, voxels; 0 for a ball.
using Line = std::array<double, 7>;
using Place = std::array<double, 3>;

// Bricks of an index of this shape within `reach` voxels of the points.
std::vector<uint8_t> bricks_near(std::span<const Place> points, double reach, const std::array<int, 3>& shape);

// Least squared distances from samples to capsules within reach; of[m] is the axis of point m, which are at most a voxel apart.
// squares: [layout.count, 512], to be lowered.
void lower_squares(std::span<const Line> lines, std::span<const Place> points, std::span<const int32_t> of, double reach,
                   const volume::Layout& layout, float* squares);

// Grid steps from each sample to the nearest seed, at most 255, by breadth-first search over sampled bricks.
std::vector<uint8_t> steps_to(const volume::Layout& layout, const bool* seeds);

}  // namespace fracslice::printing
