// How far points are from a triangle (Ericson, "Real-Time Collision Detection", 2005).
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "triangles.h"

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

// What many points ask of one triangle is worked out once.
class TriangleDistance {
  public:
    TriangleDistance() = default;
    TriangleDistance(const double* a, const double* b, const double* c) {
        for (int k = 0; k < 3; ++k) a_[k] = a[k], u_[k] = b[k] - a[k], v_[k] = c[k] - a[k];
        uu_ = dot(u_, u_), uv_ = dot(u_, v_), vv_ = dot(v_, v_);
    }
    TriangleDistance(const MeshView& mesh, size_t t) : TriangleDistance(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)) {}

    // Parts of a triangle: its inside, its corners, and the side opposite to each corner.
    enum Part { kInside, kCorner, kSide = kCorner + 3 };

    // The square of the distance of the nearest point; where a needle of a triangle leaves no digits to find it, of another of
    // its points, never of one outside.
    double square(const double* p) const {
        double x[3];
        away(p, x);
        return dot(x, x);
    }
    // The vector from the nearest point, and the part that this point is on: kCorner + k is corner k.
    int away(const double* p, double* x) const {
        for (int k = 0; k < 3; ++k) x[k] = p[k] - a_[k];
        double d1 = dot(u_, x), d2 = dot(v_, x);
        if (d1 <= 0 && d2 <= 0) return kCorner;
        double d3 = d1 - uu_, d4 = d2 - uv_, d5 = d1 - uv_, d6 = d2 - vv_, s = 0, t = 0;
        int part = kInside;
        if (d3 >= 0 && d4 <= d3) {
            s = 1, part = kCorner + 1;
        } else if (d6 >= 0 && d5 <= d6) {
            t = 1, part = kCorner + 2;
        } else if (d1 * d4 - d3 * d2 <= 0 && d1 >= 0 && d3 <= 0) {
            s = d1 / (d1 - d3), part = kSide + 2;
        } else if (d5 * d2 - d1 * d6 <= 0 && d2 >= 0 && d6 <= 0) {
            t = d2 / (d2 - d6), part = kSide + 1;
        } else if (d3 * d6 - d5 * d4 <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
            t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            s = 1 - t, part = kSide;
        } else if (double area = square_area(); area > 0) {
            s = std::clamp((vv_ * d1 - uv_ * d2) / area, 0.0, 1.0);
            t = std::clamp((uu_ * d2 - uv_ * d1) / area, 0.0, 1 - s);
        }
        for (int k = 0; k < 3; ++k) x[k] -= s * u_[k] + t * v_[k];
        return part;
    }

    // The normal, as long as twice the area; the square of its length, and the sum of the squares of the sides.
    void normal(double* n) const {
        for (int k = 0; k < 3; ++k) {
            int i = (k + 1) % 3, j = (k + 2) % 3;
            n[k] = u_[i] * v_[j] - u_[j] * v_[i];
        }
    }
    // The plane that it lies in, its normal a unit vector; and those through its sides, their normals outwards.
    std::array<Plane, 4> planes() const {
        std::array<Plane, 4> result;
        double w[3] = {v_[0] - u_[0], v_[1] - u_[1], v_[2] - u_[2]};
        const double *along[3] = {u_, w, v_};
        Point n;
        normal(n.data());
        double size = std::sqrt(dot(n.data(), n.data()));
        for (double& x : n) x /= size;
        result[0] = {n, dot(n.data(), a_)};
        for (size_t side = 0; side < 3; ++side) {
            double from[3];
            for (size_t k = 0; k < 3; ++k) {
                size_t i = (k + 1) % 3, j = (k + 2) % 3;
                double across = along[side][i] * n[j] - along[side][j] * n[i];
                result[side + 1].normal[k] = side == 2 ? -across : across;
                from[k] = a_[k] + (side == 1 ? u_[k] : 0);
            }
            result[side + 1].offset = dot(result[side + 1].normal.data(), from);
        }
        return result;
    }
    double square_area() const { return uu_ * vv_ - uv_ * uv_; }
    double square_sides() const { return 2 * (uu_ + vv_ - uv_); }

  private:
    static double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

    double a_[3], u_[3], v_[3], uu_, uv_, vv_;
};

}  // namespace fracslice::mesh
