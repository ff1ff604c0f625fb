// Extreme points of a solid in given directions, by pattern search (Hooke and Jeeves 1961).
#pragma once
#include <array>
#include <vector>

#include "field_values.h"

namespace fracslice::volume {

// The steps of a direction, and what each gains; the same number and gains for all directions.
struct Steps {
    const double *x, *y, *z;  // [directions][steps]
    const double* gain;       // [steps]
    size_t count;
};

// Moves interior points outwards as far as possible: a step is taken if it ends inside, the one that gains most; if none of a
// direction's points moves, its step length is halved, from `first` until it is below `exact`. points[k] is row k of
// [directions][starts]. Points are evaluated in blocks, on the threads of the arena.
void climb(const FieldValues& field, const std::array<double*, 3>& points, size_t directions, size_t starts, const Steps& steps,
           double first, double exact);

}  // namespace fracslice::volume
