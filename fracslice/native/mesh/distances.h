// Signed distances of the points of a packet, as machine code asks for them.
#pragma once
#include <cstddef>

namespace fracslice::mesh {

// What `fracslice.expr.emitter` calls, by its place in memory: with this, the coordinates of `count` points, those of each axis
// one after the other, and where their distances go.
struct Distances {
    void (*floats)(const Distances*, const float* points, float* values, size_t count);
    void (*doubles)(const Distances*, const double* points, double* values, size_t count);
    const void* shape;
};

// Neighbours in a packet are near each other, and so are packets: each search begins where the one before ended.
template <class Shape>
inline thread_local size_t last_found = 0;

template <class Shape, class Real>
void distances(const Distances* entry, const Real* points, Real* values, size_t count) {
    const Shape& shape = *static_cast<const Shape*>(entry->shape);
    for (size_t i = 0; i < count; ++i) {
        double p[Shape::kAxes];
        for (size_t k = 0; k < Shape::kAxes; ++k) p[k] = double(points[k * count + i]);
        values[i] = Real(shape(p, last_found<Shape>));
    }
}

template <class Shape>
Distances entry_of(const Shape* shape) {
    return {&distances<Shape, float>, &distances<Shape, double>, shape};
}

}  // namespace fracslice::mesh
