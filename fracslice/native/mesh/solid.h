// A closed mesh as machine code asks for it: signed distances of the points of a packet.
#pragma once
#include <optional>

#include "distances.h"
#include "mesh_field.h"

namespace fracslice::mesh {

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

}  // namespace fracslice::mesh
