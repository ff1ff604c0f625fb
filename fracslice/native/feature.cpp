#include "feature.h"

#include <algorithm>

namespace fracslice {
namespace {

using Matrix = std::array<Vec3, 3>;

// Eigenvalues and eigenvectors (columns) of a symmetric matrix, by Jacobi's rotations (1846).
void eigen(Matrix a, Vec3& values, Matrix& vectors) {
    vectors = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    bool turned = true;
    for (int sweep = 0; sweep < 8 && turned; ++sweep) {
        turned = false;
        for (int p = 0; p < 2; ++p) {
            for (int q = p + 1; q < 3; ++q) {
                if (std::abs(a[p][q]) < 1e-15) continue;
                turned = true;
                double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                double t = std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; ++k) {
                    double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for (int k = 0; k < 3; ++k) {
                    double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                }
                for (int k = 0; k < 3; ++k) {
                    double x = vectors[k][p], y = vectors[k][q];
                    vectors[k][p] = c * x - s * y;
                    vectors[k][q] = s * x + c * y;
                }
            }
        }
    }
    values = {a[0][0], a[1][1], a[2][2]};
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
    Matrix a{};
    Vec3 b{};
    for (int i = 0; i < count; ++i) {
        const Vec3& n = crossings[i].normal;
        double d = dot(n, crossings[i].point - mean);
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) a[r][c] += n[r] * n[c];
            b[r] += d * n[r];
        }
    }
    Vec3 values;
    Matrix vectors;
    eigen(a, values, vectors);
    std::array<int, 3> order = {0, 1, 2};
    std::sort(order.begin(), order.end(), [&](int i, int j) { return values[i] > values[j]; });
    auto column = [&](int k) { return Vec3{vectors[0][order[k]], vectors[1][order[k]], vectors[2][order[k]]}; };
    // Where two planes meet is a line; a third direction, if the planes tell it, makes it a corner.
    if (!(values[order[1]] > kRank * values[order[0]])) return false;
    Vec3 line = mean;
    for (int k = 0; k < 2; ++k) line = line + (dot(column(k), b) / values[order[k]]) * column(k);
    if (values[order[2]] > kRank * values[order[0]]) {
        point = line + (dot(column(2), b) / values[order[2]]) * column(2);
        if (fits(crossings, count, point) && moved_inside(point, lower, margin)) return true;
    }
    return clipped(line, column(2), lower, margin, point) && fits(crossings, count, point);
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
