#include "solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "topology.h"

namespace fracslice::mesh {
namespace {

// The most cells along each side of the grid.
constexpr size_t kCells = 1024;

// Whether an edge crosses the line from a point along x, the same for both directions of the edge.
bool crosses(const double* a, const double* b, double x, double y) {
    if ((a[1] > y) == (b[1] > y)) return false;
    if (a[1] > b[1]) std::swap(a, b);
    return a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > x;
}

// Twice the area of a triangle in projection, positive if it faces up.
double area(const double* a, const double* b, const double* c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

}  // namespace

Winding::Winding(const MeshView& mesh) : mesh_(mesh), side_(std::clamp(size_t(std::sqrt(double(mesh.count))), size_t(1), kCells)) {
    for (size_t k = 0; k < 2; ++k) {
        double low = mesh.positions[k], high = low;
        for (size_t v = 0; v < mesh.vertices; ++v) {
            low = std::min(low, mesh.positions[3 * v + k]), high = std::max(high, mesh.positions[3 * v + k]);
        }
        low_[k] = low, high_[k] = high, scale_[k] = double(side_) / std::max(high - low, 1e-30);
    }
    auto each = [&](const auto& act) {
        for (size_t t = 0; t < mesh.count; ++t) {
            if (area(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)) == 0) continue;  // no line goes through it
            size_t first[2], last[2];
            for (size_t k = 0; k < 2; ++k) {
                double a = mesh.corner(t, 0)[k], b = mesh.corner(t, 1)[k], c = mesh.corner(t, 2)[k];
                first[k] = cell(std::min({a, b, c}), k), last[k] = cell(std::max({a, b, c}), k);
            }
            for (size_t i = first[0]; i <= last[0]; ++i) {
                for (size_t j = first[1]; j <= last[1]; ++j) act(i * side_ + j, t);
            }
        }
    };
    starts_.resize(side_ * side_ + 1);
    each([&](size_t cell, size_t) { ++starts_[cell + 1]; });
    for (size_t k = 1; k < starts_.size(); ++k) starts_[k] += starts_[k - 1];
    triangles_.resize(starts_.back());
    std::vector<size_t> next(starts_.begin(), starts_.end() - 1);
    each([&](size_t cell, size_t t) { triangles_[next[cell]++] = uint32_t(t); });
}

size_t Winding::cell(double value, size_t axis) const {
    return size_t(std::clamp((value - low_[axis]) * scale_[axis], 0.0, double(side_ - 1)));
}

void Winding::inside(std::span<const double> points, bool* inside) const {
    std::vector<Crossing> crossings;
    double x = std::numeric_limits<double>::quiet_NaN(), y = x;
    for (size_t i = 0; i < points.size() / 3; ++i) {
        const double* p = &points[3 * i];
        inside[i] = false;
        if (p[0] < low_[0] || p[0] > high_[0] || p[1] < low_[1] || p[1] > high_[1]) continue;
        if (p[0] != x || p[1] != y) x = p[0], y = p[1], cross(x, y, crossings);
        int winding = 0;
        for (const Crossing& one : crossings) winding += one.height > p[2] ? one.turn : 0;
        inside[i] = winding != 0;
    }
}

// In projection, edges cross a line along x by one rule for both of their triangles, so that exactly one of them contains a
// point on an edge.
void Winding::cross(double x, double y, std::vector<Crossing>& crossings) const {
    crossings.clear();
    const size_t at = cell(x, 0) * side_ + cell(y, 1);
    for (size_t entry = starts_[at]; entry < starts_[at + 1]; ++entry) {
        const size_t t = triangles_[entry];
        const double *a = mesh_.corner(t, 0), *b = mesh_.corner(t, 1), *c = mesh_.corner(t, 2);
        if (!(crosses(a, b, x, y) ^ crosses(b, c, x, y) ^ crosses(c, a, x, y))) continue;
        const double up = area(a, b, c);
        double s = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / up;
        double r = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / up;
        crossings.push_back({a[2] + s * (b[2] - a[2]) + r * (c[2] - a[2]), up > 0 ? 1 : -1});
    }
}

void MeshField::points(std::span<const double> points, double* values) const {
    std::vector<double> known;
    std::vector<size_t> which;
    auto is_finite = [](const double* p) { return std::isfinite(p[0] + p[1] + p[2]); };
    size_t first = 0;
    while (first < points.size() && is_finite(&points[first])) first += 3;
    if (first == points.size()) return finite_points(points, values);
    for (size_t i = 0; i < points.size() / 3; ++i) {
        const double* p = &points[3 * i];
        values[i] = std::numeric_limits<double>::quiet_NaN();
        if (is_finite(p)) known.insert(known.end(), p, p + 3), which.push_back(i);
    }
    std::vector<double> found(which.size());
    finite_points(known, found.data());
    for (size_t i = 0; i < which.size(); ++i) values[which[i]] = found[i];
}

void MeshField::finite_points(std::span<const double> points, double* values) const {
    const size_t count = points.size() / 3;
    auto inside = std::make_unique<bool[]>(count);
    winding_.inside(points, inside.get());
    nearest_.near(points, values);
    for (size_t i = 0; i < count; ++i) values[i] = inside[i] ? -values[i] : values[i];
}

void MeshField::bricks(std::span<const int32_t> corners, const std::array<double, 3>& origin, double voxel, float* values) const {
    std::array<double, 3 * 512> grid;
    std::array<double, 512> result;
    for (size_t brick = 0; brick < corners.size() / 3; ++brick) {
        const int32_t* corner = &corners[3 * brick];
        for (int s = 0; s < 512; ++s) {
            const int at[3] = {s >> 6, s >> 3 & 7, s & 7};
            for (size_t k = 0; k < 3; ++k) grid[3 * size_t(s) + k] = origin[k] + voxel * (corner[k] + at[k]);
        }
        points(grid, result.data());
        std::copy(result.begin(), result.end(), values + 512 * brick);
    }
}

namespace {

double dot(const Point& a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The unit normal of a triangle.
Point unit_normal(const MeshView& mesh, size_t t) {
    Point n;
    TriangleDistance(mesh, t).normal(n.data());
    const double length = std::sqrt(dot(n, n.data()));
    for (double& x : n) x /= length;
    return n;
}

// The angle between two sides at a corner.
double angle(const double* at, const double* one, const double* other) {
    Point u, v;
    for (size_t k = 0; k < 3; ++k) u[k] = one[k] - at[k], v[k] = other[k] - at[k];
    return std::acos(std::clamp(dot(u, v.data()) / std::sqrt(dot(u, u.data()) * dot(v, v.data())), -1.0, 1.0));
}

}  // namespace

Solid::Solid(const MeshView& mesh, const TreeView& tree)
    : mesh_(mesh), low_(tree.low + 3), high_(tree.high + 3), nearest_(mesh, tree, false), across_(opposite_corners(mesh)), normals_(mesh.vertices, Point{}),
      entry_(entry_of(this)) {
    set_normals();
}

void Solid::set_normals() {
    std::vector<int32_t> corners(mesh_.vertices, 0), first(mesh_.vertices, -1);
    for (size_t t = 0; t < mesh_.count; ++t) {
        const Point n = unit_normal(mesh_, t);
        for (size_t k = 0; k < 3; ++k) {
            const size_t v = size_t(mesh_[t][k]);
            ++corners[v], first[v] = int32_t(3 * t + k);
            const double turn = angle(mesh_.corner(t, int(k)), mesh_.corner(t, int((k + 1) % 3)), mesh_.corner(t, int((k + 2) % 3)));
            for (size_t x = 0; x < 3; ++x) normals_[v][x] += turn * n[x];
        }
    }
    for (size_t v = 0; v < mesh_.vertices; ++v) {
        int32_t fan = 0;
        for (int32_t c = first[v]; c >= 0 && (fan == 0 || c != first[v]) && fan <= corners[v]; ++fan) c = after(across_[size_t(after(c))]);
        if (fan == corners[v]) continue;
        normals_[v] = {};
        if (!winding_) winding_.emplace(mesh_);
    }
}

double Solid::operator()(const double* p, size_t& found) const {
    if (!std::isfinite(p[0] + p[1] + p[2])) return std::numeric_limits<double>::quiet_NaN();
    const Neighbour nearest = nearest_.first(p, found);
    found = nearest.triangle;
    const double distance = std::sqrt(nearest.square);
    return distance == 0 || outside(p, nearest.triangle) ? distance : -distance;
}

bool Solid::outside(const double* p, size_t triangle) const {
    for (size_t k = 0; k < 3; ++k) {
        if (p[k] < low_[k] || p[k] > high_[k]) return true;
    }
    double x[3], side = 0;
    const int part = TriangleDistance(mesh_, triangle).away(p, x);
    if (part >= TriangleDistance::kSide) {
        const size_t opposite = size_t(across_[3 * triangle + size_t(part - TriangleDistance::kSide)]);
        side = dot(unit_normal(mesh_, triangle), x) + dot(unit_normal(mesh_, opposite / 3), x);
    } else if (part >= TriangleDistance::kCorner) {
        side = dot(normals_[size_t(mesh_[triangle][part - TriangleDistance::kCorner])], x);
    } else {
        side = dot(unit_normal(mesh_, triangle), x);
    }
    if (side != 0 || !winding_) return side >= 0;
    bool inside = false;
    winding_->inside({p, 3}, &inside);
    return !inside;
}

double Solid::least(const double* p) const {
    double square = 0, deep = -std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < 3; ++k) {
        const double away = std::max(low_[k] - p[k], p[k] - high_[k]);
        square += away > 0 ? away * away : 0, deep = std::max(deep, away);
    }
    return square > 0 ? std::sqrt(square) * (1 - 0x1p-40) : deep;
}

double Solids::operator()(const double* p, size_t& found) const {
    if (!std::isfinite(p[0] + p[1] + p[2])) return std::numeric_limits<double>::quiet_NaN();
    const size_t count = solids_.size(), first = found % count;
    size_t at = found / count;
    double nearest = (*solids_[first])(p, at);
    found = at * count + first;
    for (size_t i = 0; i < count; ++i) {
        if (i == first || !(solids_[i]->least(p) < nearest)) continue;
        size_t triangle = 0;
        const double distance = (*solids_[i])(p, triangle);
        if (distance < nearest) nearest = distance, found = triangle * count + i;
    }
    return nearest;
}

}  // namespace fracslice::mesh
