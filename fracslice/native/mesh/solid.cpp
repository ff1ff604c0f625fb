#include "solid.h"

#include <cmath>
#include <limits>

#include "topology.h"

namespace fracslice::mesh {
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

}  // namespace fracslice::mesh
