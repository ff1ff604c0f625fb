#include "measures.h"

#include <tbb/parallel_for.h>

#include <cmath>

namespace fracslice {
namespace {

using Vec = std::array<double, 3>;

constexpr size_t kBlock = size_t(1) << 14;

Vec difference(const double* a, const double* b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Vec cross(const Vec& a, const Vec& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Twice a triangle's area long.
Vec normal(const MeshView& mesh, size_t t) {
    const double* a = mesh.corner(t, 0);
    return cross(difference(mesh.corner(t, 1), a), difference(mesh.corner(t, 2), a));
}

// What act(first, last) returns for each block of `count` things.
template <class Part, class Do>
std::vector<Part> in_blocks(size_t count, const Do& act) {
    std::vector<Part> parts((count + kBlock - 1) / kBlock);
    tbb::parallel_for(size_t(0), parts.size(), [&](size_t k) {
        parts[k] = act(k * kBlock, std::min(count, (k + 1) * kBlock));
    });
    return parts;
}

}  // namespace

Measures measures(const MeshView& mesh, const Vec& point) {
    Measures all;
    for (const Measures& part : in_blocks<Measures>(mesh.count, [&](size_t first, size_t last) {
             Measures sum;
             for (size_t t = first; t < last; ++t) {
                 Vec n = normal(mesh, t);
                 double length = std::sqrt(dot(n, n));
                 sum.area += length / 2;
                 sum.volume += dot(n, difference(mesh.corner(t, 0), point.data())) / 6;
                 sum.flat += length == 0;
             }
             return sum;
         })) {
        all.area += part.area, all.volume += part.volume, all.flat += part.flat;
    }
    return all;
}

std::vector<int64_t> turned(const MeshView& mesh, const double* points) {
    MeshView moved = mesh;
    moved.positions = points;
    using Found = std::vector<int64_t>;
    Found all;
    for (const Found& part : in_blocks<Found>(mesh.count, [&](size_t first, size_t last) {
             Found found;
             for (size_t t = first; t < last; ++t) {
                 if (!(dot(normal(mesh, t), normal(moved, t)) > 0)) found.push_back(int64_t(t));
             }
             return found;
         })) {
        all.insert(all.end(), part.begin(), part.end());
    }
    return all;
}

Bounds bounds(const double* points, size_t count) {
    auto spread = [](Bounds& to, const Vec& low, const Vec& high) {
        for (int k = 0; k < 3; ++k) to.low[k] = std::min(to.low[k], low[k]), to.high[k] = std::max(to.high[k], high[k]);
    };
    auto at = [&](size_t i) { return Vec{points[3 * i], points[3 * i + 1], points[3 * i + 2]}; };
    Bounds all{at(0), at(0)};
    for (const Bounds& part : in_blocks<Bounds>(count, [&](size_t first, size_t last) {
             Bounds found{at(first), at(first)};
             for (size_t i = first; i < last; ++i) spread(found, at(i), at(i));
             return found;
         })) {
        spread(all, part.low, part.high);
    }
    return all;
}

}  // namespace fracslice
