// Where the planes through a cell's crossings meet.
#pragma once
#include <array>
#include <cmath>

namespace fracslice {

using Vec3 = std::array<double, 3>;

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec3 operator*(double s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

using Normal = std::array<float, 3>;

inline double dot(const Normal& a, const Normal& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// A crossing: where the surface meets a grid edge, in grid units, and its normal there.
struct Crossing {
    Vec3 point, normal;
};

// Unit normals further apart than this (25 degrees) make a feature; Kobbelt et al. 2001 use the same.
constexpr double kSharp = 0.9;

// The cosine of half that angle: normals all nearer to one of them make none.
constexpr double kHalfSharp = 0.975;

inline bool sharp(const Crossing& a, const Crossing& b) { return dot(a.normal, b.normal) < kSharp; }

// The point of a cell nearest to all the planes, in the least squares sense and no further from their points' mean than
// they ask for (Kobbelt, Botsch, Schwanecke and Seidel 2001, "Feature sensitive surface extraction"; the quadratic error
// of Garland and Heckbert 1997). lower: the cell's lower corner. The point lies strictly inside the cell, `margin` from its
// faces. Returns false where the planes do not meet in one point of the cell: then there is no feature but roughness.
bool feature_point(const Crossing* crossings, int count, const Vec3& lower, double margin, Vec3& point);

// Where the surface's trace in a cell face has its corner: the two crossings' tangents in the face intersected. axis: the
// face's normal; lower: its lower corner. Returns false where they do not meet within the face, `margin` from its edges.
bool face_corner(const Crossing& a, const Crossing& b, int axis, const Vec3& lower, double margin, Vec3& corner);

}  // namespace fracslice
