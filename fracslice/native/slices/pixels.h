// Pixels as cells of marching squares: the signs of their corners, and how much of each is inside.
#pragma once
#include <algorithm>

#include "slab.h"

namespace fracslice {

// The signs of the corners 0 to 3 of each cell of a tile; a cell has the bit of its corner 0.
struct Corners {
    uint64_t word[4];

    Corners(const Slab& slab, int k, int y, int x) {
        uint64_t s = slab.word(k, y, x), up = slab.word(k, y + 1, x), right = slab.word(k, y, x + 1), diagonal = slab.word(k, y + 1, x + 1);
        uint64_t r = rights(s, right);
        word[0] = s, word[1] = r, word[2] = uppers(r, rights(up, diagonal)), word[3] = uppers(s, up);
    }
    uint64_t whole() const { return word[0] & word[1] & word[2] & word[3]; }
    uint64_t mixed() const { return (word[0] | word[1] | word[2] | word[3]) & ~whole(); }
    int signs(int bit) const {
        return int(word[0] >> bit & 1) | int(word[1] >> bit & 1) << 1 | int(word[2] >> bit & 1) << 2 | int(word[3] >> bit & 1) << 3;
    }
};

// The inside part of a cell, by its signs, unless they alternate: with u and v the inside parts of the two sides that are
// crossed, each first + slope * share, it is whole + product * u v + sum * (u + v).
struct Shape {
    uint8_t side_u, side_v;
    float first_u, slope_u, first_v, slope_v, whole, product, sum;
};
constexpr Shape corner(int u, bool far_u, int v, bool far_v, bool outside) {
    float sign = outside ? -1 : 1;
    return {uint8_t(u), uint8_t(v), far_u ? 1.f : 0.f, far_u ? -1.f : 1.f, far_v ? 1.f : 0.f, far_v ? -1.f : 1.f, outside ? 1.f : 0.f, sign / 2, 0};
}
constexpr Shape half(int u, int v, bool outside) {
    return {uint8_t(u), uint8_t(v), 0, 1, 0, 1, outside ? 1.f : 0.f, 0, outside ? -0.5f : 0.5f};
}
constexpr Shape all(bool inside) { return {0, 0, 0, 0, 0, 0, inside ? 1.f : 0.f, 0, 0}; }
// Sides: lower, right, upper, left.
constexpr Shape kShapes[16] = {
    all(false),                       corner(0, false, 3, false, false), corner(0, true, 1, false, false), half(3, 1, false),
    corner(2, true, 1, true, false),  all(false),                        half(0, 2, true),                 corner(2, false, 3, true, true),
    corner(2, false, 3, true, false), half(0, 2, false),                 all(false),                       corner(2, true, 1, true, true),
    half(3, 1, true),                 corner(0, true, 1, false, true),   corner(0, false, 3, false, true), all(true)};

// Where the edges of the cells of a tile are crossed; those that are not crossed have no meaning.
class Cells {
 public:
    Cells(const Slab& slab, const Place& p) : slab_(slab), scale_(slab.scale[p.layer]) {
        const int32_t* here = slab.spot(p.layer, p.y, p.x);
        for (int up = 0; up < 2; ++up)
            for (int right = 0; right < 2; ++right) tiles_[up][right] = here[up * slab.columns() + right];
    }
    // The shares of the sides before their crossings, from the left or from below: lower, right, upper, left.
    std::array<float, 4> sides(int bit) const {
        const int right = (bit & 7) == 7, upper = bit >> 3 == 7;
        const int beside = right ? bit - 7 : bit + 1, above = upper ? bit - 56 : bit + 8, across = above + beside - bit;
        const int32_t t = tiles_[0][0];
        if (scale_ == 0) {
            constexpr float unit = 1 / kWhole;
            const auto& own = slab_.cross[t];
            return {own[bit] * unit, slab_.cross[tiles_[0][right]][64 + beside] * unit, slab_.cross[tiles_[upper][0]][above] * unit,
                    own[64 + bit] * unit};
        }
        const float corners[4] = {slab_.values[t][bit], slab_.values[tiles_[0][right]][beside], slab_.values[tiles_[upper][right]][across],
                                  slab_.values[tiles_[upper][0]][above]};
        float f[4];
        for (int i = 0; i < 4; ++i) f[i] = corners[i] * (corners[i] < 0 ? scale_ : 1);
        return {f[0] / (f[0] - f[1]), f[1] / (f[1] - f[2]), f[3] / (f[3] - f[2]), f[0] / (f[0] - f[3])};
    }
    // Whether the inside corners q and q + 2 of an alternating cell are connected: if more of its border is inside.
    static bool joined(const std::array<float, 4>& s, int q) {
        float more = s[0] + s[3] - s[2] - s[1];
        return q == 0 ? more > 0 : more < 0;
    }
    // The inside part of a cell.
    float area(int bit, int signs) const {
        const std::array<float, 4> s = sides(bit);
        if (signs == 5 || signs == 10) {
            bool whole = joined(s, signs == 10);
            int first = whole ? 15 - signs : signs, one = first == 5 ? 1 : 2;
            float parts = part(s, one) + part(s, 4 * one);
            return whole ? 1 - parts : parts;
        }
        return part(s, signs);
    }

 private:
    static float part(const std::array<float, 4>& s, int signs) {
        const Shape& shape = kShapes[signs];
        float u = shape.first_u + shape.slope_u * s[shape.side_u], v = shape.first_v + shape.slope_v * s[shape.side_v];
        return shape.whole + shape.product * u * v + shape.sum * (u + v);
    }

    const Slab& slab_;
    float scale_;
    int32_t tiles_[2][2];
};

// How much of a pixel of a tile is inside, its sharp corners included.
inline float coverage(const Slab& slab, const Cells& cells, int32_t tile, int bit, int signs) {
    float area = cells.area(bit, signs);
    return slab.sharp[tile] >> bit & 1 ? std::clamp(area + slab.tip(tile, bit), 0.f, 1.f) : area;
}

}  // namespace fracslice
