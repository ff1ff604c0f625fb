// Whether two triangles of a mesh meet in more than what their shared vertices span, decided by signs of exact predicates
// alone (the idea of Guigue and Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates",
// 2003).
#pragma once
#include "triangles.h"

namespace fracslice::mesh {

// How a triangle is seen along the axis along which it is broadest: its corners turn that way, 1 or -1. 0 for a triangle
// without area.
struct Aspect {
    int8_t axis, turn;
};

Aspect aspect_of(const MeshView& mesh, size_t t);

struct Facet {
    int32_t corners[3];
    Aspect aspect;
};

// Different triangles with area.
bool overlap(const MeshView& mesh, const Facet& s, const Facet& t);

}  // namespace fracslice::mesh
