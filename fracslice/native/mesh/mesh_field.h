// A closed mesh as a field: distances, negative where the mesh winds around a point.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "nearest.h"

namespace fracslice::mesh {

// Winding numbers by vertical rays, which find their triangles in a grid over x and y.
class Winding {
  public:
    explicit Winding(const MeshView& mesh);

    // Whether the mesh winds around points [n, 3]. Consecutive points above each other share the crossings of their line.
    void inside(std::span<const double> points, bool* inside) const;

  private:
    struct Crossing {
        double height;
        int turn;  // 1 where the triangle faces up, else -1
    };

    size_t cell(double value, size_t axis) const;
    void cross(double x, double y, std::vector<Crossing>& crossings) const;

    MeshView mesh_;
    double low_[2], high_[2], scale_[2];  // corners of the grid, and cells per unit
    size_t side_;               // cells along each axis
    std::vector<size_t> starts_;
    std::vector<uint32_t> triangles_;  // of each cell
};

class MeshField {
  public:
    // A mesh and its tree outlive this.
    MeshField(const MeshView& mesh, const TreeView& tree) : nearest_(mesh, tree, false), winding_(mesh) {}

    // Values at points [n, 3]; NaN where one is not finite.
    void points(std::span<const double> points, double* values) const;
    // The same on bricks of 8 x 8 x 8 grid points, from their first ones: [n, 3] to [n, 512], offset x*64 + y*8 + z.
    void bricks(std::span<const int32_t> corners, const std::array<double, 3>& origin, double voxel, float* values) const;

  private:
    void finite_points(std::span<const double> points, double* values) const;

    Nearest nearest_;
    Winding winding_;
};

}  // namespace fracslice::mesh
