// A closed mesh as machine code asks for it: signed distances of the points of a packet.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "distances.h"
#include "nearest.h"

// A closed mesh as a field: distances, negative where the mesh winds around a point.

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

// Negative inside. The nearest triangle is found exactly; the side is that of the pseudonormal of its part that is nearest
// (Baerentzen and Aanaes, "Signed Distance Computation Using the Angle Weighted Pseudonormal", 2005), and at vertices that join
// several fans, which have none, that of the winding number.
class Solid {
  public:
    static constexpr size_t kAxes = 3;

    // A closed, oriented surface of triangles with an area that do not intersect, and its tree; both outlive this.
    Solid(const MeshView& mesh, const TreeView& tree);
    Solid(const Solid&) = delete;
    Solid& operator=(const Solid&) = delete;

    const Distances* entry() const { return &entry_; }
    // The distance of a point; NaN where it is not finite. The search begins with a triangle, which becomes the one found.
    double operator()(const double* p, size_t& found) const;
    // At most the distance of a point: that of its box.
    double least(const double* p) const;

  private:
    bool outside(const double* p, size_t triangle) const;
    // Sums of unit normals times angles; zero at vertices that join several fans.
    void set_normals();

    MeshView mesh_;
    const double *low_, *high_;  // corners of its box
    Nearest nearest_;
    std::vector<int32_t> across_;
    std::vector<Point> normals_;  // of vertices
    std::optional<Winding> winding_;
    Distances entry_;
};

// Solids that may overlap: the least of their distances.
class Solids {
  public:
    static constexpr size_t kAxes = 3;

    // At least one; they outlive this.
    explicit Solids(std::vector<const Solid*> solids) : solids_(std::move(solids)), entry_(entry_of(this)) {}
    Solids(const Solids&) = delete;
    Solids& operator=(const Solids&) = delete;

    const Distances* entry() const { return &entry_; }
    // As of one solid. The search begins with a triangle of a solid, which become those found: with few solids between them.
    double operator()(const double* p, size_t& found) const;

  private:
    std::vector<const Solid*> solids_;
    Distances entry_;
};

}  // namespace fracslice::mesh
