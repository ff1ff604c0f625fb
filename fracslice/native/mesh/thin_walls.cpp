#include "thin_walls.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "blocks.h"
#include "triangles.h"

namespace fracslice::mesh {
namespace {

// The greatest cosine between the normals of the two faces of a wall, as in fracslice.printing.walls.
constexpr double kOpposite = -0.5;
// Parts of the limit: sides of triangles that have one ray, and of the parts of larger ones, which have one more at each corner.
constexpr double kSmall = 0.25, kPart = 0.5;
// The weights of a ray's corner and of the two others.
constexpr double kNear = 0.9, kFar = 0.05;
// The most parts along a side.
constexpr double kMost = 1 << 12;
// How far beside a triangle a ray still meets it, as a share of its sides: none passes between two.
constexpr double kBeside = 1e-9;

Vec3 corner(const MeshView& mesh, size_t t, int k) {
    const double* p = mesh.corner(t, k);
    return {p[0], p[1], p[2]};
}

// A triangle: a corner, its sides from there, and its normal, as long as twice the area.
struct Sides {
    Vec3 a, u, v, normal;

    Sides(const MeshView& mesh, size_t t)
        : a(corner(mesh, t, 0)), u(corner(mesh, t, 1) - a), v(corner(mesh, t, 2) - a), normal(cross(u, v)) {}

    double longest() const {
        const Vec3 w = v - u;
        return std::sqrt(std::max({dot(u, u), dot(v, v), dot(w, w)}));
    }
};

struct Hit {
    double length;
    size_t triangle;
};

class Rays {
  public:
    Rays(const MeshView& mesh, const TreeView& tree) : mesh_(mesh), tree_(tree) {}

    // The first triangle but `own` along a unit direction within `limit`; of that length if there is none.
    Hit first(const Vec3& from, const Vec3& along, double limit, size_t own) const {
        Hit hit{limit, own};
        size_t open[128] = {1};
        for (int height = 1; height > 0;) {
            const size_t node = open[--height];
            if (!passes(node, from, along, hit.length)) continue;
            if (node < tree_.leaves) {
                open[height++] = 2 * node, open[height++] = 2 * node + 1;
                continue;
            }
            const size_t leaf = node - tree_.leaves;
            for (size_t i = tree_.first(leaf); i < tree_.last(leaf); ++i) {
                const size_t t = size_t(tree_.order[i]);
                if (t == own) continue;
                if (double length = meets(t, from, along); length < hit.length) hit = {length, t};
            }
        }
        return hit;
    }

  private:
    bool passes(size_t node, const Vec3& from, const Vec3& along, double length) const {
        const double *low = tree_.low + 3 * node, *high = tree_.high + 3 * node;
        if (low[0] > high[0]) return false;  // empty
        double first = 0, last = length;
        for (size_t k = 0; k < 3; ++k) {
            if (along[k] == 0) {
                if (from[k] < low[k] || from[k] > high[k]) return false;
                continue;
            }
            const double p = (low[k] - from[k]) / along[k], q = (high[k] - from[k]) / along[k];
            first = std::max(first, std::min(p, q)), last = std::min(last, std::max(p, q));
        }
        return first <= last * (1 + kBeside);
    }

    // How far along the ray (Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997).
    double meets(size_t t, const Vec3& from, const Vec3& along) const {
        constexpr double never = std::numeric_limits<double>::infinity();
        const Sides sides(mesh_, t);
        const Vec3 p = cross(along, sides.v), way = from - sides.a, q = cross(way, sides.u);
        const double volume = dot(sides.u, p);
        if (volume == 0) return never;
        const double u = dot(way, p) / volume, v = dot(along, q) / volume, length = dot(sides.v, q) / volume;
        return u >= -kBeside && v >= -kBeside && u + v <= 1 + kBeside && length > 0 ? length : never;
    }

    const MeshView& mesh_;
    const TreeView& tree_;
};

bool neighbours(const MeshView& mesh, size_t t, size_t other) {
    const int32_t *a = mesh[t], *b = mesh[other];
    return std::any_of(a, a + 3, [&](int32_t v) { return std::find(b, b + 3, v) != b + 3; });
}

// The thinnest ray of a triangle; without area if none is thinner than the limit.
ThinWall thinnest(const MeshView& mesh, const Rays& rays, size_t t, double limit) {
    const Sides own(mesh, t);
    const double twice = std::sqrt(dot(own.normal, own.normal)), side = own.longest();
    ThinWall wall{limit};
    if (!(twice > 0)) return wall;
    const Vec3 inwards = (-1 / twice) * own.normal;
    const int parts = int(std::clamp(std::ceil(side / (kPart * limit)), 1.0, kMost)), rays_each = side > kSmall * limit ? 4 : 1;
    auto look = [&](double s, double r) {
        const Vec3 from = own.a + (s / parts) * own.u + (r / parts) * own.v;
        const Hit hit = rays.first(from, inwards, limit, t);
        if (hit.triangle == t || neighbours(mesh, t, hit.triangle)) return;
        const Vec3 other = Sides(mesh, hit.triangle).normal;
        if (dot(other, inwards) < -kOpposite * std::sqrt(dot(other, other))) return;
        wall[1] += twice / 2 / parts / parts / rays_each;
        if (hit.length >= wall[0]) return;
        const Vec3 middle = from + (hit.length / 2) * inwards;
        wall[0] = hit.length, wall[2] = middle[0], wall[3] = middle[1], wall[4] = middle[2];
    };
    // A part, from its corner where the sides meet, which go up or down.
    auto look_all = [&](int i, int j, int way) {
        look(i + way / 3.0, j + way / 3.0);
        if (rays_each == 1) return;
        look(i + way * kFar, j + way * kFar), look(i + way * kNear, j + way * kFar), look(i + way * kFar, j + way * kNear);
    };
    for (int i = 0; i < parts; ++i) {
        for (int j = 0; i + j < parts; ++j) {
            look_all(i, j, 1);
            if (i + j + 1 < parts) look_all(i + 1, j + 1, -1);
        }
    }
    return wall;
}

}  // namespace

std::vector<ThinWall> thin_walls(const MeshView& mesh, const TreeView& tree, size_t count, double limit) {
    const Rays rays(mesh, tree);
    return joined(in_blocks<std::vector<ThinWall>>(count, [&](size_t first, size_t last) {
        std::vector<ThinWall> found;
        for (size_t t = first; t < last; ++t) {
            if (const ThinWall wall = thinnest(mesh, rays, t, limit); wall[1] > 0) found.push_back(wall);
        }
        return found;
    }));
}

}  // namespace fracslice::mesh
