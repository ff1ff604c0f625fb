// Layers and images as the files of printers hold them.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "deflate.h"
#include "marching_squares.h"

namespace fracslice::slices {

// How a screen shows a layer, its back up.
struct View {
    int rows, columns;       // of the picture
    bool transposed;         // rows run along the layer's y
    bool backwards;          // columns run from right to left
    std::array<int, 2> at;   // row and column of the layer's first pixel as seen from above, the first row in front
    std::array<int, 2> shape;  // of the layer
    std::array<uint8_t, 256> levels;  // of the screen, by the coverage; 0 of 0, 255 of 255
};

struct Picture {
    const Rows<uint8_t>* data;  // until this thread makes another
    Painted painted;
};

Picture picture(const Slab& slab, const View& view, Encoding encoding);
// Until this thread makes another.
const Rows<uint8_t>& encoded(const Canvas& image, Encoding encoding);

}  // namespace fracslice::slices
