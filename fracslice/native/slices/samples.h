// Samples of tiles as a list, and their signs back in the tiles.
#pragma once
#include <cstddef>
#include <span>

#include "tiles.h"

namespace fracslice::slices {

// Samples of a tile.
struct Ask {
    int32_t tile;
    uint64_t samples;
};

// Those whose values are negative, those whose values are beyond a rim, and those that are so where it is calm.
struct Signs {
    uint64_t negative, beyond, calm;
};

// What squared values are compared with: `least`, once they are scaled by a factor for inside, or of their tile for outside.
// Where it is calm, less is enough outside, and any value inside.
struct Rim {
    float inside;
    const float* outside;
    float least, calm;
};

constexpr size_t kSlack = 64;  // numbers that `gather` may write and `scatter` may read behind the last one

// Where samples lie: x by columns and y by rows of the lattice, in the order of tiles and bits.
void gather(std::span<const Ask> asks, const Tiles& tiles, const float* x, const float* y, float* to_x, float* to_y);

// The values `f` of the same samples, into the tiles. rim: null if none is beyond.
void scatter(std::span<const Ask> asks, const float* f, const Rim* rim, Tiles& tiles, Signs* result);

}  // namespace fracslice::slices
