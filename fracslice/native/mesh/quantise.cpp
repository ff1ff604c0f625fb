#include "quantise.h"

#include <cassert>
#include <cmath>

#include "blocks.h"

namespace fracslice::mesh {
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

}  // namespace fracslice::mesh
