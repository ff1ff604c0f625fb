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

// Slabs of one lattice, each with the same layer, that are shown together.
using Slabs = std::vector<const Slab*>;

// Of a pixel in several of them, the greatest part is shown.
Picture picture(const Slabs& slabs, const View& view, Encoding encoding);

// A layer of an object on a plate of several.
struct Piece {
    Slabs slabs;
    View view;                                // of the object alone
    bool upside_down;                         // its rows come in the other order
    std::vector<std::array<int, 2>> places;  // row and column of its first pixel in the picture, for each time it is shown
};

// All of them in one picture, from rows of equal pixels of each object; two of them may overlap in a place.
Picture picture(const std::vector<Piece>& pieces, int rows, int columns, Encoding encoding);
// Until this thread makes another.
const Rows<uint8_t>& encoded(const Canvas& image, Encoding encoding);

}  // namespace fracslice::slices
