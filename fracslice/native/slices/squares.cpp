#include "squares.h"

#include <algorithm>
#include <cstring>
#include <memory>

#include "bits.h"

namespace fracslice {
namespace {

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

// Where the edges of a mixed cell are crossed; those that are not crossed have no meaning.
class Cell {
 public:
    Cell(const Slab& slab, const Place& p, int32_t t, int bit) : cross_(slab.cross.data()), t_(t), bit_(bit) {
        right_ = (bit & 7) == 7 ? std::max(slab.at(p.layer, p.y, p.x + 1), 0) : t;
        upper_ = bit >> 3 == 7 ? std::max(slab.at(p.layer, p.y + 1, p.x), 0) : t;
    }
    // Whether the inside corners q and q + 2 of an alternating cell are connected: if more of its border is inside.
    bool joined(int q) const {
        float more = lower() + left() - upper() - right();
        return q == 0 ? more > 0 : more < 0;
    }
    // The inside part of the cell's area.
    float area(int signs) const {
        switch (signs) {
            case 0: return 0;
            case 1: return lower() * left() / 2;
            case 2: return (1 - lower()) * right() / 2;
            case 4: return (1 - upper()) * (1 - right()) / 2;
            case 8: return upper() * (1 - left()) / 2;
            case 3: return (left() + right()) / 2;
            case 9: return (lower() + upper()) / 2;
            case 5: return joined(0) ? 1 - area(2) - area(8) : area(1) + area(4);
            case 10: return joined(1) ? 1 - area(1) - area(4) : area(2) + area(8);
            default: return 1 - area(15 - signs);
        }
    }

 private:
    // The share of an edge before its crossing, from the left or from below.
    float lower() const { return cross_[t_][bit_] / kWhole; }
    float left() const { return cross_[t_][64 + bit_] / kWhole; }
    float right() const { return cross_[right_][64 + (bit_ & 56) + ((bit_ + 1) & 7)] / kWhole; }
    float upper() const { return cross_[upper_][(bit_ + 8) & 63] / kWhole; }

    const std::array<uint16_t, 128>* cross_;
    int32_t t_, right_, upper_;
    int bit_;
};

// Sets a span of pixels of one row.
void fill(const Canvas& canvas, int y, int x, int n) {
    uint8_t* first = canvas.data + y * canvas.down + x * canvas.across;
    if (canvas.across == 1 || canvas.across == -1)
        std::memset(canvas.across > 0 ? first : first - (n - 1), 255, size_t(n));
    else
        for (int i = 0; i < n; ++i) first[i * canvas.across] = 255;
}

// Sets the pixels of a word of signs.
void fill(const Canvas& canvas, int y0, int x0, uint64_t whole) {
    for (int r = 0; r < std::min(kTile, canvas.rows - y0); ++r)
        for (uint32_t line = uint32_t(whole >> kTile * r & 0xFF); line; line &= line - 1)
            if (int x = x0 + lowest(line); x < canvas.columns)
                canvas.data[(y0 + r) * canvas.down + x * canvas.across] = 255;
}

// The outline of a cell's inside, counter-clockwise, leaves along one edge and comes back along another.
void link(const Cell& cell, int signs, const int32_t* e, std::vector<Crossing>& edges) {
    bool alone = (signs == 5 && !cell.joined(0)) || (signs == 10 && !cell.joined(1));
    for (int q = 0; q < 4; ++q) {
        int g = (q + 1) & 3;
        if (!(signs >> q & 1) || signs >> g & 1) continue;
        int to = alone ? (q + 3) & 3 : g;
        while (!alone && !(signs >> ((to + 1) & 3) & 1)) to = (to + 1) & 3;
        edges[e[q]].following = e[to];
    }
}

}  // namespace

Painted paint(const Slab& slab, int k, const Canvas& canvas) {
    Painted painted{0, 0};
    for (int y = 1; y < slab.rows() - 1; ++y) {
        int y0 = kTile * (y - 1), full = 0;  // tiles before this one that are full
        if (y0 >= canvas.rows) break;
        for (int x = 1; x < slab.columns(); ++x) {
            int32_t t = slab.at(k, y, x);
            int x0 = kTile * (x - 1);
            bool empty = t == kEmpty || x0 >= canvas.columns;
            Corners corners(slab, k, y, empty ? 0 : x);
            uint64_t whole = empty ? 0 : corners.whole();
            uint64_t sharp = t >= 0 ? slab.sharp[t] : 0;
            if (whole == kAll && !sharp) {
                ++full;
                continue;
            }
            if (full) {
                int first = x0 - kTile * full, n = std::min(x0, canvas.columns) - first;
                for (int r = y0; r < std::min(y0 + kTile, canvas.rows); ++r) fill(canvas, r, first, n);
                painted.area += kTile * kTile * double(full);
                full = 0;
            }
            if (empty) continue;
            painted.area += __builtin_popcountll(whole & ~sharp);
            fill(canvas, y0, x0, whole & ~sharp);
            for (uint64_t mixed = t >= 0 ? corners.mixed() | sharp : 0; mixed; mixed &= mixed - 1) {
                int bit = lowest(mixed), r = y0 + (bit >> 3), c = x0 + (bit & 7);
                if (r >= canvas.rows || c >= canvas.columns) continue;
                float area = Cell(slab, {k, y, x}, t, bit).area(corners.signs(bit));
                if (sharp >> bit & 1) area = std::clamp(area + slab.tip(t, bit), 0.f, 1.f);
                canvas.data[r * canvas.down + c * canvas.across] = uint8_t(255 * area + 0.5f);
                painted.area += area;
                ++painted.partly;
            }
        }
    }
    return painted;
}

Crossings crossings(const Slab& slab, int k) {
    Crossings found;
    auto [first, end] = slab.span[k];
    std::unique_ptr<int32_t[]> ids(new int32_t[size_t(end - first) * 128]);
    auto id = [&, first = first](int32_t t, int number) -> int32_t& { return ids[128 * size_t(t - first) + number]; };
    for (int y = 1; y < slab.rows() - 1; ++y)
        for (int x = 1; x < slab.columns() - 1; ++x) {
            int32_t t = slab.at(k, y, x);
            if (t < 0) continue;
            uint64_t s = slab.inside[t];
            uint64_t words[2] = {s ^ rights(s, slab.word(k, y, x + 1)), s ^ uppers(s, slab.word(k, y + 1, x))};
            for (uint64_t w = words[0] | words[1]; w; w &= w - 1) {
                int bit = lowest(w), r = bit >> 3, c = bit & 7;
                for (int up = 0; up < 2; ++up) {
                    if (!(words[up] >> bit & 1)) continue;
                    id(t, 64 * up + bit) = int32_t(found.edges.size());
                    found.edges.push_back({kTile * (x - 1) + c, kTile * (y - 1) + r, up, -1});
                    found.ends.push_back(slab.values[t][bit]);
                    found.ends.push_back(slab.value({k, y, x}, t, r + up, c + 1 - up));
                }
            }
        }
    for (int y = 1; y < slab.rows() - 1; ++y)
        for (int x = 1; x < slab.columns() - 1; ++x) {
            int32_t t = slab.at(k, y, x);
            if (t < 0) continue;
            Corners corners(slab, k, y, x);
            for (uint64_t mixed = corners.mixed(); mixed; mixed &= mixed - 1) {
                int bit = lowest(mixed);
                int32_t right = (bit & 7) == 7 ? std::max(slab.at(k, y, x + 1), first) : t;
                int32_t upper = bit >> 3 == 7 ? std::max(slab.at(k, y + 1, x), first) : t;
                const int32_t e[4] = {id(t, bit), id(right, 64 + (bit & 56) + ((bit + 1) & 7)), id(upper, (bit + 8) & 63),
                                      id(t, 64 + bit)};
                link(Cell(slab, {k, y, x}, t, bit), corners.signs(bit), e, found.edges);
            }
        }
    return found;
}

}  // namespace fracslice
