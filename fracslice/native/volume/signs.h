// The signs of the samples as bit rows: a brick is eight words, one for each x; bit y*8 + z is set where the value is < 0.
#pragma once
#include <vector>

#include "bricks.h"

namespace fracslice::volume {

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
