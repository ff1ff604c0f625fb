// On which side does a point lie: answered exactly, and fast where the answer is clear.
//
// Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates" (1997), in two
// stages: a plain determinant decides when it exceeds its error bound; otherwise it is summed without rounding. Exact as long
// as products of three coordinates neither overflow nor underflow, and only where the compiler contracts nothing to fused
// multiply-adds: CMakeLists.txt sees to that for all files that include this one.
#pragma once
#include <cmath>

namespace fracslice::mesh {

namespace exact {

constexpr double kEpsilon = 0x1p-53;
constexpr double kBound2 = (3 + 16 * kEpsilon) * kEpsilon, kBound3 = (7 + 56 * kEpsilon) * kEpsilon;

int side_of_line(double ax, double ay, double bx, double by, double cx, double cy);
int side_of_plane(const double* a, const double* b, const double* c, const double* d);

}  // namespace exact

// 1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they lie on one line.
inline int side_of_line(double ax, double ay, double bx, double by, double cx, double cy) {
    double left = (ax - cx) * (by - cy), right = (ay - cy) * (bx - cx), det = left - right;
    double bound = exact::kBound2 * (std::abs(left) + std::abs(right));
    if (std::abs(det) > bound) return det > 0 ? 1 : -1;
    return bound == 0 ? 0 : exact::side_of_line(ax, ay, bx, by, cx, cy);
}

// 1 if d lies below the plane of a, b, c (they turn clockwise as d sees them), -1 above, 0 on it: the sign of
// det(a - d, b - d, c - d).
inline int side_of_plane(const double* a, const double* b, const double* c, const double* d) {
    double adx = a[0] - d[0], ady = a[1] - d[1], adz = a[2] - d[2];
    double bdx = b[0] - d[0], bdy = b[1] - d[1], bdz = b[2] - d[2];
    double cdx = c[0] - d[0], cdy = c[1] - d[1], cdz = c[2] - d[2];
    double bc = bdx * cdy, cb = cdx * bdy, ca = cdx * ady, ac = adx * cdy, ab = adx * bdy, ba = bdx * ady;
    double det = adz * (bc - cb) + bdz * (ca - ac) + cdz * (ab - ba);
    double bound = exact::kBound3 * ((std::abs(bc) + std::abs(cb)) * std::abs(adz) +
                                     (std::abs(ca) + std::abs(ac)) * std::abs(bdz) +
                                     (std::abs(ab) + std::abs(ba)) * std::abs(cdz));
    if (std::abs(det) > bound) return det > 0 ? 1 : -1;
    return bound == 0 ? 0 : exact::side_of_plane(a, b, c, d);
}

}  // namespace fracslice::mesh
