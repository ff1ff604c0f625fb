// Where the planes through a cell's crossings meet.
#pragma once
#include <cmath>
#include <span>

#include "vec3.h"

namespace fracslice::mesh {

using Normal = std::array<float, 3>;

inline Normal operator-(const Normal& n) { return {-n[0], -n[1], -n[2]}; }
inline float dot(const Normal& a, const Normal& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// A crossing: where the surface meets an edge of the unit cell, and its normal there.
struct Crossing {
    Vec3 point, normal;
};

// Unit normals further apart than this (25 degrees) make a feature; Kobbelt et al. 2001 use the same.
constexpr double kSharp = 0.9;

// Whether a unit normal with these other two coordinates is along an axis, as float32 rounds it.
inline bool along_axis(float u, float v) { return std::abs(u) + std::abs(v) <= 1e-7f; }

// The cosine of half that angle: normals all nearer to one of them make none.
constexpr float kHalfSharp = 0.975f;

inline bool sharp(const Crossing& a, const Crossing& b) { return dot(a.normal, b.normal) < kSharp; }

// The point of the unit cell nearest to all the planes, in the least squares sense and no further from their points' mean
// than they ask for (Kobbelt, Botsch, Schwanecke and Seidel 2001, "Feature sensitive surface extraction"; the quadratic error
// of Garland and Heckbert 1997). The point lies strictly inside the cell, `margin` from its faces. Returns false where the
// planes do not meet in one point of the cell: then there is no feature but roughness.
bool feature_point(std::span<const Crossing> crossings, double margin, Vec3& point);

// Where the surface's trace in the cell's lower face along `axis` has its corner: the two crossings' tangents in the face
// intersected. Returns false where they do not meet within the face, `margin` from its edges.
bool face_corner(const Crossing& a, const Crossing& b, int axis, double margin, Vec3& corner);

}  // namespace fracslice::mesh
