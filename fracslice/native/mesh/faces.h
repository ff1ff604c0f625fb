// Which faces of its cell the loop of crossings of a case passes.
#pragma once
#include "cells.h"

namespace fracslice::mesh {

// The face that two edges share: axis*2 + (0 lower, 1 upper).
constexpr int8_t common_face(int e, int f) {
    const Edge &a = kEdges[e], &b = kEdges[f];
    const int pa[3] = {a.dx, a.dy, a.dz}, pb[3] = {b.dx, b.dy, b.dz};
    for (int axis = 0; axis < 3; ++axis) {
        if (axis != a.axis && axis != b.axis && pa[axis] == pb[axis]) return int8_t(2 * axis + pa[axis]);
    }
    return -1;
}

// One face after each crossing; and after which crossing the loop passes the lower face along each axis, -1 where it does
// not, or twice.
struct Faces {
    std::array<int8_t, sizeof(Case::loop)> after{};
    std::array<int8_t, 3> lower{-1, -1, -1};
};

constexpr std::array<Faces, 256> make_faces() {
    std::array<Faces, 256> faces{};
    for (int c = 0; c < 256; ++c) {
        int count = kCases[c].loop_length, times[3] = {0, 0, 0};
        for (int k = 0; k < count; ++k) {
            int face = common_face(kCases[c].loop[k], kCases[c].loop[(k + 1) % count]);
            faces[c].after[k] = int8_t(face);
            if (face % 2 == 0) faces[c].lower[face / 2] = int8_t(times[face / 2]++ ? -1 : k);
        }
    }
    return faces;
}
constexpr std::array<Faces, 256> kFaces = make_faces();

}  // namespace fracslice::mesh
