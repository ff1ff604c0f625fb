#include "feature.h"

#include <algorithm>

namespace fracslice::mesh {
namespace {

// A symmetric matrix: its diagonal, and the elements that are left where row and column k are struck out.
struct Symmetric {
    Vec3 diagonal{}, other{};

    Vec3 row(int k) const {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        Vec3 result;
        result[k] = diagonal[k], result[u] = other[v], result[v] = other[u];
        return result;
    }
};

// The rows of the adjugate; as symmetric as the matrix. Their products with the matrix' rows are its determinant.
std::array<Vec3, 3> adjugate(const Symmetric& a) {
    Vec3 x = a.row(0), y = a.row(1), z = a.row(2);
    return {cross(y, z), cross(z, x), cross(x, y)};
}

// The least eigenvalue: Newton's method on the characteristic polynomial, which comes to it from below.
double least_eigenvalue(double trace, double minors, double determinant) {
    double value = determinant / minors;
    for (int step = 0; step < 20 && value > 0; ++step) {
        double p = ((trace - value) * value - minors) * value + determinant;
        double further = p / (minors - (2 * trace - 3 * value) * value);
        if (!(further > 0)) break;
        value += further;
        if (further < 1e-3 * trace) break;  // The error is of the order of its square.
    }
    return value;
}

Vec3 product(const std::array<Vec3, 3>& rows, const Vec3& b) { return {dot(rows[0], b), dot(rows[1], b), dot(rows[2], b)}; }

// The unit eigenvector of a simple eigenvalue `value` of A: the adjugate of A - value I is the outer product of that vector
// with itself, times a factor.
Vec3 eigenvector(const Symmetric& a, std::array<Vec3, 3> adjugate, double trace, double value) {
    int longest = 0;
    for (int k = 0; k < 3; ++k) {
        adjugate[k] = adjugate[k] + value * a.row(k);
        adjugate[k][k] += value * (value - trace);
        if (adjugate[k][k] > adjugate[longest][longest]) longest = k;
    }
    const Vec3& v = adjugate[longest];
    double square = dot(v, v);
    return square > 0 ? (1 / std::sqrt(square)) * v : Vec3{0, 0, 1};
}

// Directions whose eigenvalue is a smaller share of the trace say nothing about where the planes meet.
constexpr double kRank = 0.01;

// How far outside its cell a feature may lie to be moved to the cell's border instead of being given up. The edge of an acute
// wedge enters cells without crossings, and is moved from further there.
constexpr double kNear = 0.4, kNearWedge = 1;

// How far from its planes a feature may lie, root mean square.
constexpr double kMiss = 0.06;

// Moves a point to the border of the unit cell, `margin` inside, if it is not further outside than `near`.
bool moved_inside(Vec3& point, double margin, double near = kNear) {
    for (double& x : point) {
        if (!(x > -near && x < 1 + near)) return false;
        x = std::clamp(x, margin, 1 - margin);
    }
    return true;
}

// Whether a point is in the unit cell, `margin` from its faces.
bool inside(const Vec3& p, double margin) {
    return std::min({p[0], p[1], p[2]}) >= margin && std::max({p[0], p[1], p[2]}) <= 1 - margin;
}

// Whether a point whose distances from `count` planes have this sum of squares is near enough to them.
bool fits(double squares, int count) { return squares < kMiss * kMiss * count; }

// The point of a line in the unit cell that is nearest to `start`; where the line misses the cell by little, the
// cell's point beside it.
bool clipped(const Vec3& start, const Vec3& direction, double margin, double near, Vec3& point) {
    double first = -10, last = 10;
    for (int k = 0; k < 3; ++k) {
        double low = margin - start[k], high = 1 - margin - start[k];
        if (std::abs(direction[k]) < 1e-9) {
            if (low > near || high < -near) return false;
            continue;
        }
        double over = 1 / direction[k], p = low * over, q = high * over;
        first = std::max(first, std::min(p, q));
        last = std::min(last, std::max(p, q));
    }
    double at = first <= last ? std::clamp(0.0, first, last) : (first + last) / 2;
    point = start + at * direction;
    return moved_inside(point, margin, near);
}

// Normals of a wedge: two directions at more than this angle (70 degrees), and none between them.
constexpr double kWedge = 0.34, kOneSide = 0.95;

// Whether the crossings lie on the two sides of a wedge. The edge of a round ridge has normals of all directions between.
bool wedge(std::span<const Crossing> crossings) {
    const Vec3 *one = nullptr, *two = nullptr;
    double least = kWedge;
    for (const Crossing& a : crossings) {
        for (const Crossing& b : crossings) {
            double cosine = dot(a.normal, b.normal);
            if (cosine < least) least = cosine, one = &a.normal, two = &b.normal;
        }
    }
    if (!one) return false;
    return std::all_of(crossings.begin(), crossings.end(), [&](const Crossing& c) {
        return std::max(dot(c.normal, *one), dot(c.normal, *two)) > kOneSide;
    });
}

}  // namespace

bool feature_point(std::span<const Crossing> crossings, double margin, Vec3& point) {
    const int count = int(crossings.size());
    Vec3 mean{};
    for (const Crossing& crossing : crossings) mean = mean + (1.0 / count) * crossing.point;
    Symmetric a;
    Vec3 b{};
    double miss = 0;
    for (const Crossing& crossing : crossings) {
        const Vec3& n = crossing.normal;
        double d = dot(n, crossing.point - mean);
        miss += d * d;
        for (int k = 0; k < 3; ++k) {
            a.diagonal[k] += n[k] * n[k];
            a.other[k] += n[(k + 1) % 3] * n[(k + 2) % 3];
            b[k] += d * n[k];
        }
    }
    // Where two planes meet is a line; a third direction, if the planes tell it, makes it a corner. The trace is `count`; the
    // determinant over the sum of the minors is the least eigenvalue, or a little less.
    auto inverse = adjugate(a);
    double determinant = dot(a.row(0), inverse[0]), minors = inverse[0][0] + inverse[1][1] + inverse[2][2];
    if (!(minors > 2 * kRank * count * count)) return false;
    if (determinant > kRank * minors * count) {
        Vec3 best = (1 / determinant) * product(inverse, b);
        if (!fits(miss - dot(b, best), count)) return false;
        point = mean + best;
        if (moved_inside(point, margin)) return true;
    }
    double least = least_eigenvalue(count, minors, determinant), others = count - least;
    Vec3 along = eigenvector(a, inverse, count, least);
    // Across that direction the matrix solves its characteristic polynomial, which is so its inverse (Cayley and Hamilton).
    Vec3 rest = b - dot(along, b) * along;
    Vec3 best = (1 / (minors - least * others)) * (others * rest - product({a.row(0), a.row(1), a.row(2)}, rest));
    if (!fits(miss - dot(b, best), count)) return false;
    point = mean + best;
    if (inside(point, margin)) return true;
    if (wedge(crossings)) return clipped(mean + best, along, margin, kNearWedge, point);
    if (!clipped(mean + best, along, margin, kNear, point)) return false;
    miss = 0;
    for (const Crossing& crossing : crossings) {
        double d = dot(crossing.normal, point - crossing.point);
        miss += d * d;
    }
    return fits(miss, count);
}

bool face_corner(const Crossing& a, const Crossing& b, int axis, double margin, Vec3& corner) {
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    double au = a.normal[u], av = a.normal[v], bu = b.normal[u], bv = b.normal[v];
    double det = au * bv - av * bu, square = (au * au + av * av) * (bu * bu + bv * bv);
    if (!(det * det > 0.09 * square) || square < 0.0025) return false;
    double ca = au * a.point[u] + av * a.point[v], cb = bu * b.point[u] + bv * b.point[v];
    corner[axis] = 0.5;
    corner[u] = (ca * bv - cb * av) / det;
    corner[v] = (au * cb - bu * ca) / det;
    bool near = moved_inside(corner, margin, dot(a.normal, b.normal) < kWedge ? kNearWedge : kNear);
    corner[axis] = 0;
    return near;
}

}  // namespace fracslice::mesh
