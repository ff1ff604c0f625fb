// A view of the arrays of fracslice.volume.bricks.Bricks.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace fracslice::volume {

constexpr int kSide = 8;
constexpr int kSamples = kSide * kSide * kSide;
constexpr int32_t kOutside = -1, kInside = -2;

// Where bricks are.
struct Layout {
    const int32_t* ijk;    // [count, 3]
    size_t count;
    const int32_t* index;  // [size[0], size[1], size[2]]
    std::array<int, 3> size;

    // Row of the brick at brick coordinates x, y, z, or kOutside or kInside. All beyond the index is outside.
    int32_t at(int x, int y, int z) const {
        bool within = x >= 0 && y >= 0 && z >= 0 && x < size[0] && y < size[1] && z < size[2];
        return within ? index[(size_t(x) * size[1] + y) * size[2] + z] : kOutside;
    }
};

struct Bricks : Layout {
    const float* values;  // [count, 512], offset x*64 + y*8 + z
};

// Throws std::invalid_argument unless rows and index name each other.
void check(const Layout& layout);

}  // namespace fracslice::volume
