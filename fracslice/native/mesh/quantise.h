// A mesh at coordinates that a file can hold, and which vertices still lie where the mesher put them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "../array.h"
#include "triangles.h"

// Equal corners made one vertex, bit by bit.
namespace fracslice::mesh {

struct Welded {
    Array<int64_t> first;   // of each set of equal points
    Array<int32_t> labels;  // the set of each point
};

// bits: [n, 3], of float32 coordinates without negative zeros. Throws std::invalid_argument for more than 2^31 points.
Welded weld(std::span<const uint32_t> bits);

// The planes of a grid across the axes, ascending along each; [count, 3].
struct Planes {
    const double* at;
    size_t count;

    double operator()(size_t i, int axis) const { return at[3 * i + size_t(axis)]; }
};

// A float32 coordinate without negative zeros.
inline double rounded(double x) { return double(float(x) + 0.0f); }

// Where the vertices of a mesh come to lie: scaled, moved, and those below a bed's height on the bed, z = 0.
struct Frame {
    double scale;
    Vec3 offset;
    double bed;

    Vec3 operator()(const double* p) const {
        Vec3 q{p[0] * scale + offset[0], p[1] * scale + offset[1], p[2] * scale + offset[2]};
        if (q[2] < bed) q[2] = 0;
        return q;
    }
};

// Triangles with other corners, or removed ones, whose first corner is -1.
struct Edits {
    std::span<const int64_t> rows;  // ascending
    const int32_t* corners;         // [rows, 3]

    // Calls act(corners, number of the edit or -1) for the triangles `first` to `last` - 1 of a mesh that stay.
    template <class Do>
    void for_each(const Triangles& triangles, std::span<const bool> keep, size_t first, size_t last, const Do& act) const {
        size_t edit = size_t(std::lower_bound(rows.begin(), rows.end(), int64_t(first)) - rows.begin());
        for (size_t t = first; t < last; ++t) {
            bool edited = edit < rows.size() && size_t(rows[edit]) == t;
            const int32_t* c = edited ? corners + 3 * edit : triangles[t];
            if (c[0] >= 0 && keep[size_t(c[0])]) act(c, edited ? int64_t(edit) : -1);
            edit += edited;
        }
    }
};

struct Quantised {
    Array<double> points;     // rounded to float32, without negative zeros
    Array<bool> displaced;    // those that were, and all that are not in the same planes and strictly between the same ones
    Array<int32_t> triangles;
    std::vector<int64_t> places;  // of edited triangles, -1 for those that did not stay
    bool finite = true;
};

// keep: of vertices, those of the triangles that stay. Without planes all are displaced.
//
// Triangles of vertices that are not displaced are as free of self-intersections as contour.h proves them to be: rounding takes
// all coordinates of a plane to the same number and keeps cells apart, so that corners, crossings and tips stay strictly within
// their faces, edges and cells. It also makes no two such vertices one.
Quantised quantise(const MeshView& mesh, std::span<const bool> keep, std::span<const bool> displaced, const Edits& edits,
                   const Planes& planes, const Frame& frame);

// --- Triangles of a mesh that rounding turns over, pointed vertices, and the bounding box.

// The triangles, in order, that are flat or turn by a right angle or more when they are quantised.
std::vector<int64_t> turned(const MeshView& mesh, const Frame& frame);

// The vertices, in order, from which all edges fall off, at an angle of at least that sine. On a surface that has more than
// `most` of them, only some.
std::vector<int64_t> pointed(const MeshView& mesh, double sine, size_t most);

// The box around some points; low above high if there are none.
struct Bounds {
    static constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Vec3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
};

// points: [n, 3].
Bounds bounds(std::span<const double> points);

}  // namespace fracslice::mesh
