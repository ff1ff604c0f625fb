// Signed distances of the points of a packet, as machine code asks for them.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>

namespace fracslice::mesh {

// What `fracslice.expr.emitter` calls, by its place in memory: with this, the coordinates of `count` points, those of each axis
// one after the other, and where their distances go.
struct Distances {
    void (*floats)(const Distances*, const float* points, float* values, size_t count);
    void (*doubles)(const Distances*, const double* points, double* values, size_t count);
    const void* shape;
    uint64_t number;  // another one for each shape of the process
};

// The last packet of a thread for a shape: a scene may ask for the same one again, and rays go on where they were.
template <class Shape, class Real>
struct Recent {
    static constexpr size_t kMost = 64;  // lanes
    uint64_t number = 0;
    size_t count = 0, found[kMost];
    Real points[Shape::kAxes * kMost] = {}, values[kMost];
};

template <class Shape, class Real>
void distances(const Distances* entry, const Real* points, Real* values, size_t count) {
    thread_local Recent<Shape, Real> recents[4];
    Recent<Shape, Real>& recent = recents[entry->number % std::size(recents)];
    count = std::min(count, recent.kMost);
    if (recent.number != entry->number) {
        recent.number = entry->number, recent.count = 0;
        std::fill_n(recent.found, recent.kMost, size_t(0));
    }
    if (recent.count != count || std::memcmp(recent.points, points, Shape::kAxes * count * sizeof(Real)) != 0) {
        for (size_t i = 0; i < count; ++i) {
            Real away = 0, aside = 0;  // from the last point of this lane, and from this one of the lane before
            bool same = recent.count == count;  // a lane whose ray has ended waits for the others
            double p[Shape::kAxes];
            for (size_t axis = 0, k = i; axis < Shape::kAxes; ++axis, k += count) {
                same = same && points[k] == recent.points[k];
                away += (points[k] - recent.points[k]) * (points[k] - recent.points[k]);
                aside += i > 0 ? (points[k] - points[k - 1]) * (points[k] - points[k - 1]) : 0;
                p[axis] = double(points[k]);
            }
            if (same) continue;
            if (i > 0 && aside < away) recent.found[i] = recent.found[i - 1];
            recent.values[i] = Real((*static_cast<const Shape*>(entry->shape))(p, recent.found[i]));
        }
        std::copy_n(points, Shape::kAxes * count, recent.points);
        recent.count = count;
    }
    std::copy_n(recent.values, count, values);
}

inline std::atomic<uint64_t> shapes = 0;

template <class Shape>
Distances entry_of(const Shape* shape) {
    return {&distances<Shape, float>, &distances<Shape, double>, shape, ++shapes};
}

}  // namespace fracslice::mesh
