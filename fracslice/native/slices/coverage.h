// How much of each pixel is inside.
#pragma once
#include <array>
#include <numeric>

#include "pixels.h"

namespace fracslice::slices {

// Of the cells of a tile, by their bits: 0 to 255, which are those wholly outside and inside.
struct alignas(64) Levels : std::array<uint8_t, 64> {};

class Coverage {
 public:
    explicit Coverage(const Slab& slab) : slab_(slab), scale_(slab.scale()) {}

    // Sets the levels of a tile.
    void operator()(const Quad& tiles, const Corners& corners, Levels& levels);
    // The area inside all tiles so far in pixels, before it is rounded.
    double area() const { return std::accumulate(sums_.begin(), sums_.end(), 0.0); }

 private:
    const Slab& slab_;
    float scale_;
    std::array<double, kTile> sums_{};  // by columns
};

}  // namespace fracslice::slices
