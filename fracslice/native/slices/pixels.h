// Pixels as cells of marching squares: the signs of their corners, and how much of each is inside.
#pragma once
#include <cmath>
#include <cstring>

#include "slab.h"

namespace fracslice {

// A tile, and those to its right, above it, and to the right of that.
struct Quad {
    int32_t own, right, upper, beyond;

    Quad(const int32_t* spot, ptrdiff_t columns)
        : own(spot[0]), right(spot[1]), upper(spot[columns]), beyond(spot[columns + 1]) {}
    Quad(const Slab& slab, const Place& p) : Quad(slab.spot(p.layer, p.y, p.x), slab.columns()) {}
};

// The signs of the corners 0 to 3 of each cell of a tile; a cell has the bit of its corner 0.
struct Corners {
    uint64_t word[4];

    Corners(const Slab& slab, const Quad& tiles) {
        const uint64_t* inside = slab.inside.data();
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

constexpr int kWide = 2 * kTile;  // from row to row of the 9 x 9 samples at the cells of a tile

// A side of a cell, from one corner to another: where these are among the samples of a tile, and which side it is.
struct Side {
    uint8_t from, to, number;
    bool back;  // to the left or down

    constexpr Side(int first, int second)
        : from(kCorner[first]), to(kCorner[second]), number(uint8_t((first + 1) % 4 == second ? first : second)),
          back(from > to) {}
    float share(const Sides& s) const { return back ? 1 - s[number] : s[number]; }

 private:
    static constexpr uint8_t kCorner[4] = {0, 1, kWide + 1, kWide};
};

// The inside part of a cell, by its signs: with u and v the shares of the two sides that are crossed before their crossings,
// u v / 2 of a corner, all but that, or (u + v) / 2 of a half. `product`: 1/2, -1/2, or 0.
struct Shape {
    Side u, v;  // from inside; of all but a corner, from outside
    float product;

    float area(float u, float v) const {
        const float size = std::abs(product);
        return (size - product) + product * u * v + (0.5f - size) * (u + v);
    }
    float area(const Sides& s) const { return area(u.share(s), v.share(s)); }
};
constexpr Shape corner(int c, float product = 0.5f) { return {{c, (c + 1) % 4}, {c, (c + 3) % 4}, product}; }
constexpr Shape rest(int c) { return corner(c, -0.5f); }
// The corner c and the next one.
constexpr Shape half(int c) { return {{c, (c + 3) % 4}, {(c + 1) % 4, (c + 2) % 4}, 0}; }
constexpr Shape kNone = half(0);  // of no meaning
constexpr Shape kShapes[16] = {kNone,     corner(0), corner(1), half(0), corner(2), kNone,   half(1), rest(3),
                               corner(3), half(3),   kNone,     rest(2), half(2),   rest(1), rest(0), kNone};

// The cells of a tile that are cut.
class Cells {
 public:
    // scale: of the layer.
    Cells(const Slab& slab, float scale, const Quad& tiles) : slab_(slab), scale_(scale), tiles_(tiles) {
        if (scale_ == 0) return;
        const auto* values = slab.values.data();
        const float *own = values[tiles.own].data(), *right = values[tiles.right].data();
        for (int row = 0; row < kTile; ++row) {
            std::memcpy(samples_ + kWide * row, own + kTile * row, sizeof(float) * kTile);
            samples_[kWide * row + kTile] = right[kTile * row];
        }
        std::memcpy(samples_ + kWide * kTile, values[tiles.upper].data(), sizeof(float) * kTile);
        samples_[kWide * kTile + kTile] = values[tiles.beyond][0];
    }
    // The values at the corners of all cells, and where that at the corner 0 of a cell is.
    const float* samples() const { return samples_; }
    static int place(int bit) { return bit + (bit & 7 * kTile); }
    // The shares of the sides before their crossings, from the left or from below; those that are not crossed have no meaning.
    Sides sides(int bit) const {
        if (scale_ == 0) {
            constexpr float unit = 1 / kWhole;
            const auto &own = slab_.cross[tiles_.own], &right = slab_.cross[(bit & 7) == 7 ? tiles_.right : tiles_.own];
            const auto& upper = slab_.cross[bit >> 3 == 7 ? tiles_.upper : tiles_.own];
            const int beside = (bit & 56) + ((bit + 1) & 7), above = (bit + 8) & 63;
            return Sides{own[bit] * unit, right[64 + beside] * unit, upper[above] * unit, own[64 + bit] * unit};
        }
        const float* corner = samples_ + place(bit);
        Sides f = {corner[0], corner[1], corner[kWide + 1], corner[kWide]};
        f = f < 0 ? scale_ * f : f;
        const Sides first = {f[0], f[1], f[3], f[0]}, second = {f[1], f[2], f[2], f[3]};
        return first / (first - second);
    }
    // Whether the inside corners q and q + 2 of an alternating cell are connected: if more of its border is inside.
    static bool joined(const Sides& s, int q) {
        float more = s[0] + s[3] - s[2] - s[1];
        return q == 0 ? more > 0 : more < 0;
    }
    // The inside part of a cell.
    float area(int bit, int signs) const {
        if (signs == 0 || signs == 15) return signs ? 1 : 0;
        const Sides s = sides(bit);
        if (signs != 5 && signs != 10) return kShapes[signs].area(s);
        // The inside parts of the sides at one of the inside corners, and at the other one.
        const float a = s[0], b = s[3], c = 1 - s[1], d = 1 - s[2];
        if (signs == 5) return joined(s, 0) ? 1 - ((1 - a) * (1 - c) + (1 - b) * (1 - d)) / 2 : (a * b + c * d) / 2;
        return joined(s, 1) ? 1 - (a * b + c * d) / 2 : ((1 - a) * (1 - c) + (1 - b) * (1 - d)) / 2;
    }

 private:
    const Slab& slab_;
    float scale_;
    Quad tiles_;
    alignas(64) float samples_[kWide * (kTile + 1)];  // the values of the tile and those beside it
};

}  // namespace fracslice
