#include "quantise.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "../compiler.h"
#include "triangles.h"
#include "topology.h"

namespace fracslice::mesh {
namespace {

// How many points ahead their slots are asked for: without, most of the time goes into waiting for memory.
constexpr size_t kAhead = 16;

size_t mixed(const uint32_t* point) {
    uint64_t mixed = (point[0] * 0x9E3779B97F4A7C15u) ^ (point[1] * 0xC2B2AE3D27D4EB4Fu) ^ (point[2] * 0x165667B19E3779F9u);
    mixed = (mixed ^ (mixed >> 29)) * 0xBF58476D1CE4E5B9u;
    return mixed ^ (mixed >> 32);
}

}  // namespace

Welded weld(std::span<const uint32_t> bits) {
    const size_t count = bits.size() / 3;
    if (count > INT32_MAX) throw std::invalid_argument("more than 2^31 points");
    size_t slots = 16;
    while (slots <= 2 * count) slots *= 2;
    std::vector<int32_t> table(slots, -1);  // of sets, with open addressing
    Welded result{{count, 1}, {count, 1}};
    int32_t sets = 0;
    for (size_t i = 0; i < count; ++i) {
        const uint32_t* point = &bits[3 * i];
        if (i + kAhead < count) prefetch(&table[mixed(point + 3 * kAhead) & (slots - 1)]);
        size_t slot = mixed(point) & (slots - 1);
        while (table[slot] >= 0 && !std::equal(point, point + 3, &bits[3 * size_t(result.first.data[table[slot]])])) {
            slot = (slot + 1) & (slots - 1);
        }
        if (table[slot] < 0) {
            table[slot] = sets;
            result.first.data[sets++] = int64_t(i);
        }
        result.labels.data[i] = table[slot];
    }
    result.first.rows = size_t(sets);
    return result;
}

namespace {

// Whether all planes are distinct when rounded.
bool distinct(const Planes& planes) {
    for (size_t i = 1; i < planes.count; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            if (!(rounded(planes(i - 1, axis)) < rounded(planes(i, axis)))) return false;
        }
    }
    return planes.count > 1;
}

// Finds the planes of one axis that a coordinate lies between.
class Axis {
  public:
    Axis(const Planes& planes, int axis)
        : planes_(planes), axis_(axis), first_(planes(0, axis)),
          scale_(double(planes.count - 1) / (planes(planes.count - 1, axis) - first_)) {}

    // Whether it is still in its plane, or between the same two, when it moves to a rounded coordinate.
    bool keeps(double x, double to) const {
        size_t last = planes_.count - 1;
        double place = (x - first_) * scale_;
        size_t i = place > 0 ? std::min(size_t(place), last) : 0;
        while (i > 0 && at(i) > x) --i;
        while (i < last && at(i + 1) <= x) ++i;
        if (at(i) == x) return rounded(x) == to;
        return at(i) < x && i < last && rounded(at(i)) < to && to < rounded(at(i + 1));
    }

  private:
    double at(size_t i) const { return planes_(i, axis_); }

    const Planes& planes_;
    int axis_;
    double first_, scale_;
};

}  // namespace

Quantised quantise(const MeshView& mesh, std::span<const bool> keep, std::span<const bool> displaced, const Edits& edits,
                   const Planes& planes, const Frame& frame) {
    assert(keep.size() == mesh.vertices && displaced.size() == mesh.vertices);
    std::vector<size_t> vertices = counted(mesh.vertices, [&](size_t v) { return keep[v]; });
    std::vector<size_t> triangles = in_blocks<size_t>(mesh.count, [&](size_t first, size_t last) {
        size_t count = 0;
        edits.for_each(mesh, keep, first, last, [&](const int32_t*, int64_t) { ++count; });
        return count;
    });
    size_t total = 0;
    for (size_t& number : triangles) total += std::exchange(number, total);
    Quantised result{{vertices.back(), 3}, {vertices.back(), 1}, {total, 3}, std::vector<int64_t>(edits.rows.size(), -1)};
    Array<int32_t> number(mesh.vertices, 1);
    bool known = distinct(planes);
    std::atomic<bool> finite = true;
    for_each_block(mesh.vertices, [&](size_t block, size_t first, size_t last) {
        bool all = true;
        size_t next = vertices[block];
        for (size_t v = first; v < last; ++v) {
            number.data[v] = int32_t(next);
            if (!keep[v]) continue;
            Vec3 p = frame(mesh.point(int32_t(v)));
            for (size_t k = 0; k < 3; ++k) all &= std::isfinite(result.points.data[3 * next + k] = rounded(p[k]));
            result.displaced.data[next++] = displaced[v] || !known;
        }
        if (!all) finite.store(false, std::memory_order_relaxed);
        for (size_t k = 0; known && all && k < 3; ++k) {
            Axis axis(planes, int(k));
            for (size_t v = first, to = vertices[block]; v < last; ++v) {
                if (!keep[v]) continue;
                double x = mesh.point(int32_t(v))[k] * frame.scale + frame.offset[k];
                result.displaced.data[to] |= !axis.keeps(x, result.points.data[3 * to + k]);
                ++to;
            }
        }
    });
    result.finite = finite;
    for_each_block(mesh.count, [&](size_t block, size_t first, size_t last) {
        size_t next = triangles[block];
        edits.for_each(mesh, keep, first, last, [&](const int32_t* corners, int64_t edit) {
            if (edit >= 0) result.places[size_t(edit)] = int64_t(next);
            for (size_t k = 0; k < 3; ++k) result.triangles.data[3 * next + k] = number.data[corners[k]];
            ++next;
        });
    });
    return result;
}

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
