#include "measures.h"

#include <tbb/parallel_for.h>

#include <cmath>

#include "edge_topology.h"

namespace fracslice::mesh {
namespace {

constexpr size_t kBlock = size_t(1) << 14;

Vec3 at(const double* p) { return {p[0], p[1], p[2]}; }

// Twice a triangle's area long.
Vec3 normal(const MeshView& mesh, size_t t) {
    Vec3 a = at(mesh.corner(t, 0));
    return cross(at(mesh.corner(t, 1)) - a, at(mesh.corner(t, 2)) - a);
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

// What is found in blocks of `count` things, in order.
template <class Do>
std::vector<int64_t> chosen(size_t count, const Do& choose) {
    using Found = std::vector<int64_t>;
    Found all;
    for (const Found& part : in_blocks<Found>(count, [&](size_t first, size_t last) {
             Found found;
             for (size_t i = first; i < last; ++i) {
                 if (choose(i)) found.push_back(int64_t(i));
             }
             return found;
         })) {
        all.insert(all.end(), part.begin(), part.end());
    }
    return all;
}

}  // namespace

Measures measures(const MeshView& mesh, const Vec3& point) {
    Measures all;
    for (const Measures& part : in_blocks<Measures>(mesh.count, [&](size_t first, size_t last) {
             Measures sum;
             for (size_t t = first; t < last; ++t) {
                 Vec3 n = normal(mesh, t);
                 double length = std::sqrt(dot(n, n));
                 sum.area += length / 2;
                 sum.volume += dot(n, at(mesh.corner(t, 0)) - point) / 6;
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
    return chosen(mesh.count, [&](size_t t) { return !(dot(normal(mesh, t), normal(moved, t)) > 0); });
}

std::vector<int64_t> pointed(const MeshView& mesh, double sine) {
    CornersByVertex around = corners_by_vertex(mesh);
    const int64_t *start = around.start.data.get(), *corner = around.corner.data.get();
    return chosen(mesh.vertices, [&](size_t v) {
        Vec3 up{0, 0, 0};
        for (int64_t i = start[v]; i < start[v + 1]; ++i) up = up + normal(mesh, size_t(corner[i] / 3));
        double least = sine * std::sqrt(dot(up, up));
        for (int64_t i = start[v]; i < start[v + 1]; ++i) {
            size_t t = size_t(corner[i] / 3);
            int k = int(corner[i] % 3);
            Vec3 edge = at(mesh.corner(t, (k + 1) % 3)) - at(mesh.corner(t, k));
            if (!(-dot(edge, up) > least * std::sqrt(dot(edge, edge)))) return false;
        }
        return start[v] < start[v + 1];
    });
}

Bounds bounds(const double* points, size_t count) {
    auto spread = [](Bounds& to, const Vec3& low, const Vec3& high) {
        for (int k = 0; k < 3; ++k) to.low[k] = std::min(to.low[k], low[k]), to.high[k] = std::max(to.high[k], high[k]);
    };
    Bounds all;
    for (const Bounds& part : in_blocks<Bounds>(count, [&](size_t first, size_t last) {
             Bounds found;
             for (size_t i = first; i < last; ++i) spread(found, at(points + 3 * i), at(points + 3 * i));
             return found;
         })) {
        spread(all, part.low, part.high);
    }
    return all;
}

}  // namespace fracslice::mesh
