// Equal corners made one vertex, bit by bit.
#pragma once
#include "../array.h"

#include <cstdint>
#include <span>

namespace fracslice::mesh {

struct Welded {
    Array<int64_t> first;   // of each set of equal points
    Array<int32_t> labels;  // the set of each point
};

// bits: [n, 3], of float32 coordinates without negative zeros. Throws std::invalid_argument for more than 2^31 points.
Welded weld(std::span<const uint32_t> bits);

}  // namespace fracslice::mesh
