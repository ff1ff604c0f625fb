// How much of each pixel is inside.
#pragma once
#include <array>

#include "pixels.h"

namespace fracslice {

// Of the cells of a tile, by their bits: 0 to 255.
using Levels = std::array<uint8_t, 64>;

class Coverage {
 public:
    explicit Coverage(const Slab& slab) : slab_(slab), scale_(slab.scale) {}

    // Sets the levels of a tile. Returns the area inside in pixels, before it is rounded.
    double operator()(const Quad& tiles, const Corners& corners, Levels& levels) const;

 private:
    const Slab& slab_;
    float scale_;
};

}  // namespace fracslice
