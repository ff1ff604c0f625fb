#include "measures.h"

#include <cmath>

#include "blocks.h"
#include "stars.h"

namespace fracslice::mesh {
namespace {

// Triangles of a surface that may be rough.
constexpr size_t kRough = size_t(1) << 18;

Vec3 at(const double* p) { return {p[0], p[1], p[2]}; }

// Twice a triangle's area long.
Vec3 normal(const Vec3* corners) { return cross(corners[1] - corners[0], corners[2] - corners[0]); }

Vec3 normal(const MeshView& mesh, size_t t) {
    Vec3 corners[] = {at(mesh.corner(t, 0)), at(mesh.corner(t, 1)), at(mesh.corner(t, 2))};
    return normal(corners);
}

}  // namespace

std::vector<int64_t> turned(const MeshView& mesh, const Frame& frame) {
    return chosen(mesh.count, [&](size_t t) {
        Vec3 exact[3], moved[3];
        for (int k = 0; k < 3; ++k) {
            exact[k] = frame(mesh.corner(t, k));
            for (size_t i = 0; i < 3; ++i) moved[k][i] = rounded(exact[k][i]);
        }
        return !(dot(normal(exact), normal(moved)) > 0);
    });
}

std::vector<int64_t> pointed(const MeshView& mesh, double sine, size_t most) {
    if (mesh.count > kRough) {  // a rough surface shows in some of its triangles
        MeshView some = mesh;
        some.corners += 3 * ((mesh.count - kRough / 2) / 2), some.count = kRough / 2;
        std::vector<int64_t> result = pointed(some, sine, most);
        if (result.size() > most) return result;
    }
    auto falls_off = [&](size_t v, std::span<const int64_t> corners) {
        Vec3 up{0, 0, 0};
        int64_t ring = 0;  // not zero where triangles are missing
        for (int64_t corner : corners) {
            size_t t = size_t(corner / 3);
            int k = int(corner % 3);
            ring += mesh[t][(k + 1) % 3] - mesh[t][(k + 2) % 3];
            up = up + normal(mesh, t);
        }
        if (ring != 0) return false;
        double least = sine * std::sqrt(dot(up, up));
        for (int64_t corner : corners) {
            Vec3 edge = at(mesh.corner(size_t(corner / 3), int((corner + 1) % 3))) - at(mesh.point(int32_t(v)));
            double down = -dot(edge, up);
            if (!(down > 0) || !(down > least * std::sqrt(dot(edge, edge)))) return false;
        }
        return !corners.empty();
    };
    Stars stars(mesh);
    std::vector<std::vector<int64_t>> result(stars.blocks());
    tbb::parallel_for(size_t(0), stars.blocks(), [&](size_t block) {
        stars.for_each(block, [&](size_t v, std::span<const int64_t> corners) {
            if (falls_off(v, corners)) result[block].push_back(int64_t(v));
        });
    });
    return joined(result);
}

Bounds bounds(std::span<const double> points) {
    auto spread = [](Bounds& to, const Vec3& low, const Vec3& high) {
        for (int k = 0; k < 3; ++k) to.low[k] = std::min(to.low[k], low[k]), to.high[k] = std::max(to.high[k], high[k]);
    };
    Bounds all;
    for (const Bounds& part : in_blocks<Bounds>(points.size() / 3, [&](size_t first, size_t last) {
             Bounds result;
             for (size_t i = first; i < last; ++i) spread(result, at(&points[3 * i]), at(&points[3 * i]));
             return result;
         })) {
        spread(all, part.low, part.high);
    }
    return all;
}

}  // namespace fracslice::mesh
