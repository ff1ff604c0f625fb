#include "feature.h"

#include <algorithm>

namespace fracslice {
namespace {

// A symmetric matrix: its diagonal, and the elements that are left where row and column k are struck out.
struct Symmetric {
    Vec3 diagonal{}, other{};

    Vec3 row(int k) const {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        Vec3 found;
        found[k] = diagonal[k], found[u] = other[v], found[v] = other[u];
        return found;
    }
};

// The eigenvalues, the largest first, from the cosines of a third of an angle (Smith 1961, "Eigenvalues of a symmetric 3 x 3
// matrix"). One apart from the others is exact to rounding; two that are nearly equal, to its root.
Vec3 eigenvalues(const Symmetric& a) {
    double mean = (a.diagonal[0] + a.diagonal[1] + a.diagonal[2]) / 3;
    Vec3 d = a.diagonal - Vec3{mean, mean, mean};
    const Vec3& o = a.other;
    double size = std::sqrt((dot(d, d) + 2 * dot(o, o)) / 6);
    if (!(size > 1e-15 * mean)) return {mean, mean, mean};
    double determinant = d[0] * d[1] * d[2] + 2 * o[0] * o[1] * o[2];
    for (int k = 0; k < 3; ++k) determinant -= d[k] * o[k] * o[k];
    double angle = std::acos(std::clamp(determinant / (2 * size * size * size), -1.0, 1.0)) / 3;
    double largest = mean + 2 * size * std::cos(angle), least = mean - 2 * size * std::cos(angle - M_PI / 3);
    return {largest, 3 * mean - largest - least, least};
}

// The unit vector that the matrix takes to `value` times itself, for an eigenvalue apart from the others: across the rows of
// what is left when it is taken off.
Vec3 eigenvector(Symmetric a, double value) {
    a.diagonal = a.diagonal - Vec3{value, value, value};
    Vec3 best{};
    double longest = 0;
    for (int k = 0; k < 3; ++k) {
        Vec3 across = cross(a.row((k + 1) % 3), a.row((k + 2) % 3));
        double length = dot(across, across);
        if (length > longest) best = across, longest = length;
    }
    return longest > 0 ? (1 / std::sqrt(longest)) * best : Vec3{0, 0, 1};
}

// The solution of a x = b, by Cramer's rule: the inverse is as symmetric as the matrix.
Vec3 solved(const Symmetric& a, const Vec3& b) {
    Vec3 x = cross(a.row(1), a.row(2)), y = cross(a.row(2), a.row(0)), z = cross(a.row(0), a.row(1));
    return (1 / dot(a.row(0), x)) * Vec3{dot(x, b), dot(y, b), dot(z, b)};
}

// Directions whose eigenvalue is a smaller share of the largest say nothing about where the planes meet.
constexpr double kRank = 0.02;

// How far outside its cell a feature may lie to be moved to the cell's border instead of being given up.
constexpr double kNear = 0.4;

// How far from its planes a feature may lie, root mean square.
constexpr double kMiss = 0.06;

// Moves a point to the border of the unit cell at `lower`, `margin` inside, if it is not further outside than kNear.
bool moved_inside(Vec3& point, const Vec3& lower, double margin) {
    for (int k = 0; k < 3; ++k) {
        double inside = point[k] - lower[k];
        if (!(inside > -kNear && inside < 1 + kNear)) return false;
        point[k] = lower[k] + std::clamp(inside, margin, 1 - margin);
    }
    return true;
}

bool fits(const Crossing* crossings, int count, const Vec3& point) {
    double miss = 0;
    for (int i = 0; i < count; ++i) {
        double d = dot(crossings[i].normal, point - crossings[i].point);
        miss += d * d;
    }
    return miss < kMiss * kMiss * count;
}

// The point of a line in the unit cell at `lower` that is nearest to `start`; where the line misses the cell by little, the
// cell's point beside it.
bool clipped(const Vec3& start, const Vec3& direction, const Vec3& lower, double margin, Vec3& point) {
    double first = -10, last = 10;
    for (int k = 0; k < 3; ++k) {
        double low = lower[k] + margin - start[k], high = lower[k] + 1 - margin - start[k];
        if (std::abs(direction[k]) < 1e-9) {
            if (low > kNear || high < -kNear) return false;
            continue;
        }
        double p = low / direction[k], q = high / direction[k];
        first = std::max(first, std::min(p, q));
        last = std::min(last, std::max(p, q));
    }
    double at = first <= last ? std::clamp(0.0, first, last) : (first + last) / 2;
    point = start + at * direction;
    return moved_inside(point, lower, margin);
}

}  // namespace

bool feature_point(const Crossing* crossings, int count, const Vec3& lower, double margin, Vec3& point) {
    Vec3 mean{};
    for (int i = 0; i < count; ++i) mean = mean + (1.0 / count) * crossings[i].point;
    Symmetric a;
    Vec3 b{};
    for (int i = 0; i < count; ++i) {
        const Vec3& n = crossings[i].normal;
        double d = dot(n, crossings[i].point - mean);
        for (int k = 0; k < 3; ++k) {
            a.diagonal[k] += n[k] * n[k];
            a.other[k] += n[(k + 1) % 3] * n[(k + 2) % 3];
            b[k] += d * n[k];
        }
    }
    // Where two planes meet is a line; a third direction, if the planes tell it, makes it a corner.
    Vec3 values = eigenvalues(a);
    if (!(values[1] > kRank * values[0])) return false;
    if (values[2] > kRank * values[0]) {
        point = mean + solved(a, b);
        if (fits(crossings, count, point) && moved_inside(point, lower, margin)) return true;
    }
    Vec3 along = eigenvector(a, values[2]);
    Symmetric across = a;
    for (int k = 0; k < 3; ++k) {
        across.diagonal[k] += values[0] * along[k] * along[k];
        across.other[k] += values[0] * along[(k + 1) % 3] * along[(k + 2) % 3];
    }
    Vec3 line = mean + solved(across, b - dot(along, b) * along);
    return clipped(line, along, lower, margin, point) && fits(crossings, count, point);
}

bool face_corner(const Crossing& a, const Crossing& b, int axis, const Vec3& lower, double margin, Vec3& corner) {
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    double au = a.normal[u], av = a.normal[v], bu = b.normal[u], bv = b.normal[v];
    double det = au * bv - av * bu, size = std::hypot(au, av) * std::hypot(bu, bv);
    if (!(std::abs(det) > 0.3 * size) || size < 0.05) return false;
    double ca = au * a.point[u] + av * a.point[v], cb = bu * b.point[u] + bv * b.point[v];
    corner = a.point;
    corner[u] = (ca * bv - cb * av) / det;
    corner[v] = (au * cb - bu * ca) / det;
    double level = corner[axis];
    corner[axis] = lower[axis] + 0.5;
    bool near = moved_inside(corner, lower, margin);
    corner[axis] = level;
    return near;
}

}  // namespace fracslice
