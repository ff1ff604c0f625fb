// How much of each pixel that the contour cuts is inside.
#pragma once
#include <array>
#include <vector>

#include "pixels.h"

namespace fracslice {

// Cut cells of some tiles of a layer, gathered to be worked on side by side.
class Coverage {
 public:
    // Where the pixels of a tile lie in a picture: that of bit i at [i] from the first.
    using Spots = std::array<int32_t, 64>;

    Coverage(const Slab& slab, int layer, const Spots& spots) : slab_(slab), scale_(slab.scale[layer]), spots_(spots) {}

    // Cells of the first tile, whose first pixel lies at `first`.
    void push(const Quad& tiles, const Corners& corners, uint64_t cells, ptrdiff_t first);
    // Writes the levels of all to a picture, those of coverages from 0 to 255, and lets them go. Returns the area inside in
    // pixels, before it is rounded.
    double show(const uint8_t* levels, uint8_t* picture);

 private:
    // A cell of which more than two sides are crossed, or with a corner of its own.
    struct Rare {
        int at;
        float area;
    };
    void grow();

    const Slab& slab_;
    float scale_;
    Spots spots_;
    int count_ = 0, room_ = 0;
    // Of each cell: the values at the ends of the two sides that are crossed, and the product of its shape; then its area.
    Rows<float> from_u_, to_u_, from_v_, to_v_, product_, area_;
    Rows<ptrdiff_t> spot_;
    Rows<uint8_t> level_;
    std::vector<Rare> rare_;
};

}  // namespace fracslice
