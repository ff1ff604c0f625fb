// Distances of points from the zero set, to first order.
#pragma once
#include <span>

#include "field_values.h"

namespace fracslice::volume {

// Rows of coordinates with any strides, and their placement: scale * p + offset, for a point p in scene units.
struct PlacedPoints {
    const double* data;
    ptrdiff_t row, column;
    double scale;
    std::array<double, 3> offset;

    double at(size_t i, size_t axis) const { return (data[ptrdiff_t(i) * row + ptrdiff_t(axis) * column] - offset[axis]) / scale; }
};

// Steps of finite differences, all of one length: along the axes, against them, and along 20 diagonals.
struct Differences {
    const double* steps;  // [26, 3]
    double length;
};

// |f| over the steepest difference, at most a voxel. The steps against the axes are taken only where those along them are
// flat, and the diagonals where both are.
void surface_error(const FieldValues& field, const PlacedPoints& points, const Differences& differences, double voxel,
                   std::span<double> errors);

}  // namespace fracslice::volume
