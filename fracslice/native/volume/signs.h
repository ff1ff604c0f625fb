// The signs of the samples as bit rows: a brick is eight words, one for each x; bit y*8 + z is set where the value is < 0.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

// A view of the arrays of fracslice.volume.bricks.Bricks.

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

using BitPlane = uint64_t;
using Signs = std::array<BitPlane, kSide>;

// The bits of a plane's samples at y = 0, and at z = 0.
constexpr BitPlane kFirstY = 0xff, kFirstZ = 0x0101010101010101u;

std::vector<Signs> signs_of(const Bricks& bricks);

// How many grid edges with a sign change touch a point without a sample. Zero means that the surface is closed.
int64_t open_edges(const Layout& layout, const std::vector<Signs>& signs);

inline BitPlane constant(int32_t at) { return at == kInside ? ~BitPlane(0) : BitPlane(0); }

// The plane read one step along y or z; `next` is the plane of the neighbour on that side.
inline BitPlane shift_y(BitPlane plane, BitPlane next) { return plane >> 8 | next << 56; }
inline BitPlane shift_z(BitPlane plane, BitPlane next) {
    return (plane >> 1 & ~(kFirstZ << 7)) | (next & kFirstZ) << 7;
}

// A brick and its neighbours on the positive sides: number dx + 2*dy + 4*dz.
struct Octant {
    std::array<int32_t, 8> rows;

    Octant(const Layout& layout, int x, int y, int z) {
        for (int k = 0; k < 8; ++k) rows[k] = layout.at(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2 & 1));
    }
};

// Corner signs of a brick's cells. Word k of plane x holds, at bit y*8 + z, the sign at (x, y + k % 2, z + k / 2).
using CornerPlanes = std::array<BitPlane, 4>;
std::array<CornerPlanes, kSide + 1> corners_of(const Octant& octant, const std::vector<Signs>& signs);

}  // namespace fracslice::volume
