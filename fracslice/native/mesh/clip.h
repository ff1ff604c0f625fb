// What of a convex polygon lies over a triangle, and what beside it.
#pragma once
#include <array>
#include <vector>

namespace fracslice::mesh {

using Point = std::array<double, 3>;
using Polygon = std::vector<Point>;  // its corners in order

// Where points have dot(normal, point) = offset.
struct Plane {
    Point normal;
    double offset;

    double above(const Point& p) const { return normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2] - offset; }
};

// Cuts a convex polygon at a plane (Sutherland and Hodgman 1974, "Reentrant polygon clipping"). Returns the part above it;
// the polygon becomes the part below.
inline Polygon taken_above(const Plane& plane, Polygon& polygon) {
    Polygon above, below;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const Point &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        double d = plane.above(p), e = plane.above(q);
        (d > 0 ? above : below).push_back(p);
        if ((d > 0) == (e > 0)) continue;
        Point between;
        for (size_t x = 0; x < 3; ++x) between[x] = p[x] + d / (d - e) * (q[x] - p[x]);
        above.push_back(between), below.push_back(between);
    }
    if (below.size() < 3) below.clear();
    polygon = below;
    if (above.size() < 3) above.clear();
    return above;
}

}  // namespace fracslice::mesh
