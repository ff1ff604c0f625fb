// How large a mesh is, and what of it rounding turns over.
#pragma once
#include <limits>
#include <vector>

#include "quantise.h"

namespace fracslice::mesh {

struct Measures {
    double area = 0;
    double volume = 0;  // signed, between the triangles and a point: a closed mesh's, wherever that is
    size_t flat = 0;    // triangles without area
};

// Sums are over blocks of equal size, and so the same for any number of threads.
Measures measures(const MeshView& mesh, const Vec3& point);

// The triangles, in order, that are flat or turn by a right angle or more when they are quantised.
std::vector<int64_t> turned(const MeshView& mesh, const Frame& frame);

// The vertices, in order, from which all edges fall off, at an angle of at least that sine. On a surface that has more than
// `most` of them, only some.
std::vector<int64_t> pointed(const MeshView& mesh, double sine, size_t most);

// The box around some points; low above high if there are none.
struct Bounds {
    static constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Vec3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
};

Bounds bounds(const double* points, size_t count);

}  // namespace fracslice::mesh
