// Pixels as cells of marching squares: the signs of their corners, and how much of each is inside.
#pragma once
#include <cstring>

#include "slab.h"

namespace fracslice {

// The signs of the corners 0 to 3 of each cell of a tile; a cell has the bit of its corner 0.
struct Corners {
    uint64_t word[4];

    Corners(const Slab& slab, int k, int y, int x) {
        const uint64_t s = slab.word(k, y, x), up = slab.word(k, y + 1, x);
        word[0] = s, word[1] = rights(s, slab.word(k, y, x + 1)), word[3] = uppers(s, up);
        word[2] = uppers(word[1], rights(up, slab.word(k, y + 1, x + 1)));
    }
    uint64_t whole() const { return word[0] & word[1] & word[2] & word[3]; }
    uint64_t mixed() const { return (word[0] | word[1] | word[2] | word[3]) & ~whole(); }
    int signs(int bit) const {
        int signs = 0;
        for (int corner = 0; corner < 4; ++corner) signs |= int(word[corner] >> bit & 1) << corner;
        return signs;
    }
};

// The inside part of a cell, by its signs, unless they alternate: with u and v the inside parts of the two sides that are
// crossed, each first + slope * share, it is whole + product * u v + sum * (u + v).
struct Shape {
    uint8_t side_u, side_v;
    float first_u, slope_u, first_v, slope_v, whole, product, sum;
};
constexpr Shape corner(int u, bool far_u, int v, bool far_v) {
    return {uint8_t(u), uint8_t(v), far_u ? 1.f : 0.f, far_u ? -1.f : 1.f, far_v ? 1.f : 0.f, far_v ? -1.f : 1.f, 0, 0.5f, 0};
}
constexpr Shape half(int u, int v) { return {uint8_t(u), uint8_t(v), 0, 1, 0, 1, 0, 0, 0.5f}; }
// All but that.
constexpr Shape rest(Shape s) {
    return {s.side_u, s.side_v, s.first_u, s.slope_u, s.first_v, s.slope_v, 1 - s.whole, -s.product, -s.sum};
}
constexpr Shape kNone{0, 0, 0, 0, 0, 0, 0, 0, 0};
// Sides: lower, right, upper, left.
constexpr Shape kCorners[4] = {corner(0, false, 3, false), corner(0, true, 1, false), corner(2, true, 1, true),
                               corner(2, false, 3, true)};
constexpr Shape kLower = half(3, 1), kLeft = half(0, 2);
constexpr Shape kShapes[16] = {kNone,       kCorners[0],       kCorners[1], kLower,      kCorners[2],       kNone,
                               rest(kLeft), rest(kCorners[3]), kCorners[3], kLeft,       kNone,             rest(kCorners[2]),
                               rest(kLower), rest(kCorners[1]), rest(kCorners[0]), rest(kNone)};

// The lower, right, upper and left side of a cell.
using Sides = float __attribute__((vector_size(16)));
using Order = int __attribute__((vector_size(16)));

// Where the edges of the cells of a tile are crossed; those that are not crossed have no meaning.
class Cells {
    static constexpr int kWide = kTile + 1;

 public:
    Cells(const Slab& slab, const Place& p) : slab_(slab), scale_(slab.scale[p.layer]) {
        const int32_t* here = slab.spot(p.layer, p.y, p.x);
        tile_ = here[0], right_ = here[1], upper_ = here[slab.columns()];
        if (scale_ == 0) return;
        const float *own = slab.values[tile_].data(), *right = slab.values[right_].data();
        for (int row = 0; row < kTile; ++row) {
            std::memcpy(corners_ + kWide * row, own + kTile * row, sizeof(float) * kTile);
            corners_[kWide * row + kTile] = right[kTile * row];
        }
        std::memcpy(corners_ + kWide * kTile, slab.values[upper_].data(), sizeof(float) * kTile);
        corners_[kWide * kTile + kTile] = slab.values[here[slab.columns() + 1]][0];
    }
    // The shares of the sides before their crossings, from the left or from below.
    Sides sides(int bit) const {
        if (scale_ == 0) {
            constexpr float unit = 1 / kWhole;
            const auto &own = slab_.cross[tile_], &right = slab_.cross[(bit & 7) == 7 ? right_ : tile_];
            const auto& upper = slab_.cross[bit >> 3 == 7 ? upper_ : tile_];
            const int beside = (bit & 56) + ((bit + 1) & 7), above = (bit + 8) & 63;
            return Sides{own[bit] * unit, right[64 + beside] * unit, upper[above] * unit, own[64 + bit] * unit};
        }
        const float* corner = corners_ + bit + (bit >> 3);
        Sides f = {corner[0], corner[1], corner[kWide + 1], corner[kWide]};
        f = f < 0 ? scale_ * f : f;
        const Sides first = __builtin_shuffle(f, Order{0, 1, 3, 0}), second = __builtin_shuffle(f, Order{1, 2, 2, 3});
        return first / (first - second);
    }
    // Whether the inside corners q and q + 2 of an alternating cell are connected: if more of its border is inside.
    static bool joined(const Sides& s, int q) {
        float more = s[0] + s[3] - s[2] - s[1];
        return q == 0 ? more > 0 : more < 0;
    }
    // The inside part of a cell.
    float area(int bit, int signs) const {
        const Sides s = sides(bit);
        if (signs == 5 || signs == 10) {
            bool whole = joined(s, signs == 10);
            int first = whole ? 15 - signs : signs, one = first == 5 ? 1 : 2;
            float parts = part(s, one) + part(s, 4 * one);
            return whole ? 1 - parts : parts;
        }
        return part(s, signs);
    }

 private:
    static float part(const Sides& s, int signs) {
        const Shape& shape = kShapes[signs];
        float u = shape.first_u + shape.slope_u * s[shape.side_u], v = shape.first_v + shape.slope_v * s[shape.side_v];
        return shape.whole + shape.product * u * v + shape.sum * (u + v);
    }

    const Slab& slab_;
    float scale_;
    int32_t tile_, right_, upper_;
    float corners_[kWide * kWide];  // the values of the tile and those beside it
};

}  // namespace fracslice
