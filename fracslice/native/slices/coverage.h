// How much of each pixel is inside.
#pragma once

#include <array>
#include <numeric>

#include "slab.h"

// Pixels as cells of marching squares: the signs of their corners, and how much of each is inside.
namespace fracslice::slices {

// A tile, and those to its right, above it, and to the right of that.
struct Quad {
    int32_t own, right, upper, beyond;

    Quad(const int32_t* spot, ptrdiff_t columns)
        : own(spot[0]), right(spot[1]), upper(spot[columns]), beyond(spot[columns + 1]) {}
    Quad(const Slab& slab, const Place& p) : Quad(slab.spot(p.y, p.x), slab.columns()) {}
};

// The signs of the corners 0 to 3 of each cell of a tile; a cell has the bit of its corner 0.
struct Corners {
    uint64_t word[4];

    Corners(const Slab& slab, const Quad& tiles) {
        const uint64_t* inside = slab.tiles().inside.data();
        const uint64_t s = inside[tiles.own], up = inside[tiles.upper];
        word[0] = s, word[1] = rights(s, inside[tiles.right]), word[3] = uppers(s, up);
        word[2] = uppers(word[1], rights(up, inside[tiles.beyond]));
    }
    uint64_t whole() const { return word[0] & word[1] & word[2] & word[3]; }
    uint64_t mixed() const { return (word[0] | word[1] | word[2] | word[3]) & ~whole(); }
    // The cells of which every side is crossed.
    uint64_t alternating() const { return ~(word[0] ^ word[2]) & ~(word[1] ^ word[3]) & (word[0] ^ word[1]); }
    int signs(int bit) const {
        int signs = 0;
        for (int corner = 0; corner < 4; ++corner) signs |= int(word[corner] >> bit & 1) << corner;
        return signs;
    }
};

// The lower, right, upper and left side of a cell.
using Sides = float __attribute__((vector_size(16)));

// One cell of a tile, exactly.
class Cells {
 public:
    // scale: of the layer.
    Cells(const Slab& slab, float scale, const Quad& tiles) : slab_(slab), scale_(scale), tiles_(tiles) {}
    // The shares of the sides before their crossings, from the left or from below; those that are not crossed have no meaning.
    Sides sides(int bit) const {
        const bool last = (bit & 7) == 7, top = bit >> 3 == 7;
        const int beside = (bit & 56) + ((bit + 1) & 7), above = (bit + 8) & 63;
        const int32_t right = last ? tiles_.right : tiles_.own, upper = top ? tiles_.upper : tiles_.own;
        if (scale_ == 0) {
            constexpr float unit = 1 / kWhole;
            const auto &own = slab_.tiles().cross[tiles_.own], &next = slab_.tiles().cross[right], &over = slab_.tiles().cross[upper];
            return Sides{own[bit] * unit, next[64 + beside] * unit, over[above] * unit, own[64 + bit] * unit};
        }
        const int32_t across = last && top ? tiles_.beyond : last ? right : upper;
        const auto& values = slab_.tiles().values;
        Sides f = {values[tiles_.own][bit], values[right][beside], values[across][(above & 56) + (beside & 7)],
                   values[upper][above]};
        f = f < 0 ? scale_ * f : f;
        const Sides first = {f[0], f[1], f[3], f[0]}, second = {f[1], f[2], f[2], f[3]};
        return first / (first - second);
    }
    // Whether the inside corners q and q + 2 of an alternating cell are connected: if more of its border is inside.
    static bool joined(const Sides& s, int q) {
        const float more = s[0] + s[3] - s[2] - s[1];
        return float(1 - 2 * q) * more > 0;
    }
    // The inside part of an alternating cell.
    float area(int bit, int signs) const {
        const Sides s = sides(bit);
        // The inside parts of the sides at one of the inside corners, and at the other one.
        const float a = s[0], b = s[3], c = 1 - s[1], d = 1 - s[2];
        // Half of the areas at these corners, or at the other corners: the inside, or the outside, between them is the rest.
        const float halves[] = {(a * b + c * d) / 2, ((1 - a) * (1 - c) + (1 - b) * (1 - d)) / 2};
        const bool first = signs == 5, whole = joined(s, first ? 0 : 1);
        const float corners = halves[first == whole], areas[] = {corners, 1 - corners};
        return areas[whole];
    }

 private:
    const Slab& slab_;
    float scale_;
    Quad tiles_;
};

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
