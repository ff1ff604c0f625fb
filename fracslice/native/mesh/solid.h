// A closed mesh as machine code asks for it: signed distances of the points of a packet.
#pragma once
#include <optional>

#include "mesh_field.h"

namespace fracslice::mesh {

class Solid;

// What `fracslice.expr.emitter` calls, by its place in here: with this, the coordinates x, y and z of `count` points one after
// the other, and where their distances go.
struct Distances {
    void (*floats)(const Distances*, const float* points, float* values, size_t count);
    void (*doubles)(const Distances*, const double* points, double* values, size_t count);
    const Solid* solid;
};

// Negative inside. The nearest triangle is found exactly; the side is that of the pseudonormal of its part that is nearest
// (Baerentzen and Aanaes, "Signed Distance Computation Using the Angle Weighted Pseudonormal", 2005), and at vertices that join
// several fans, which have none, that of the winding number.
class Solid {
  public:
    // A closed, oriented surface of triangles with an area that do not intersect, and its tree; both outlive this.
    Solid(const MeshView& mesh, const TreeView& tree);
    Solid(const Solid&) = delete;
    Solid& operator=(const Solid&) = delete;

    const Distances* entry() const { return &entry_; }
    // Another one for each solid of the process.
    uint64_t number() const { return number_; }
    // The distance of a point; NaN where it is not finite. The search begins with a triangle, which becomes the one found.
    double operator()(const double* p, size_t& found) const;

  private:
    bool outside(const double* p, size_t triangle) const;
    // Sums of unit normals times angles; zero at vertices that join several fans.
    void set_normals();

    uint64_t number_;
    MeshView mesh_;
    const double *low_, *high_;  // corners of its box
    Nearest nearest_;
    std::vector<int32_t> across_;
    std::vector<Point> normals_;  // of vertices
    std::optional<Winding> winding_;
    Distances entry_;
};

}  // namespace fracslice::mesh
