// How large a mesh is, and what of it rounding turns over.
#pragma once
#include <array>
#include <vector>

#include "triangles.h"

namespace fracslice {

struct Measures {
    double area = 0;
    double volume = 0;  // signed, between the triangles and a point: a closed mesh's, wherever that is
    size_t flat = 0;    // triangles without area
};

// Sums are over blocks of equal size, and so the same for any number of threads.
Measures measures(const MeshView& mesh, const std::array<double, 3>& point);

// The triangles, in order, that are flat or turn by a right angle or more when the vertices move to `points`.
std::vector<int64_t> turned(const MeshView& mesh, const double* points);

struct Bounds {
    std::array<double, 3> low, high;
};

// Of at least one point.
Bounds bounds(const double* points, size_t count);

}  // namespace fracslice
