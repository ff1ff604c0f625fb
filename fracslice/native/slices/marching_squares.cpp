#include "marching_squares.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>

#include "coverage.h"

namespace fracslice::slices {
namespace {

// Sets a span of pixels of one row.
void fill(const Canvas& canvas, int y, int x, int n) {
    uint8_t* first = canvas.data + y * canvas.down + x * canvas.across;
    if (canvas.across == 1 || canvas.across == -1)
        std::memset(canvas.across > 0 ? first : first - (n - 1), 255, size_t(n));
    else
        for (int i = 0; i < n; ++i) first[i * canvas.across] = 255;
}

// The pixels of a tile that are on it.
uint64_t on(const Canvas& canvas, int y0, int x0) {
    const int rows = std::min(canvas.rows - y0, kTile), columns = std::min(canvas.columns - x0, kTile);
    return kAll >> 8 * (kTile - rows) & kAll / 255 * (0xFF >> (kTile - columns));
}

// The outline of a cell's inside, counter-clockwise, leaves along one edge and comes back along another.
void link(const Sides& sides, int signs, const int32_t* e, std::vector<Crossing>& edges) {
    bool alone = (signs == 5 && !Cells::joined(sides, 0)) || (signs == 10 && !Cells::joined(sides, 1));
    for (int q = 0; q < 4; ++q) {
        int g = (q + 1) & 3;
        if (!(signs >> q & 1) || signs >> g & 1) continue;
        int to = alone ? (q + 3) & 3 : g;
        while (!alone && !(signs >> ((to + 1) & 3) & 1)) to = (to + 1) & 3;
        edges[e[q]].following = e[to];
    }
}

}  // namespace

Painted paint(const Slab& slab, const Canvas& canvas) {
    Painted painted{0, 0};
    Coverage coverage(slab);
    Levels levels;
    for (int y = 1; y < slab.rows() - 1; ++y) {
        int y0 = kTile * (y - 1), full = 0;  // tiles before this one that are full
        if (y0 >= canvas.rows) break;
        for (int x = 1; x < slab.columns(); ++x) {
            int32_t t = slab.at(y, x);
            int x0 = kTile * (x - 1);
            bool empty = t == kEmpty || x0 >= canvas.columns;
            const Quad tiles(slab, {y, empty ? 0 : x, kEmpty});
            const Corners corners(slab, tiles);
            uint64_t sharp = slab.tiles().sharp[t];
            if (!empty && corners.whole() == kAll && !sharp) {
                ++full;
                continue;
            }
            if (full) {
                int first = x0 - kTile * full, n = std::min(x0, canvas.columns) - first;
                for (int r = y0; r < std::min(y0 + kTile, canvas.rows); ++r) fill(canvas, r, first, n);
                painted.area += kTile * kTile * double(full);
                full = 0;
            }
            const uint64_t cut = empty || t < kTiles ? 0 : corners.mixed() | sharp;
            if (!cut) continue;
            coverage(tiles, corners, levels);
            painted.partly += std::popcount(cut);
            each((cut | corners.whole()) & on(canvas, y0, x0), [&](int bit) {
                canvas.data[(y0 + (bit >> 3)) * canvas.down + (x0 + (bit & 7)) * canvas.across] = levels[bit];
            });
        }
    }
    painted.area += coverage.area();
    return painted;
}

Crossings crossings(const Slab& slab) {
    Crossings result;
    const int32_t first = kTiles, end = int32_t(slab.tiles().count());
    std::unique_ptr<int32_t[]> ids(new int32_t[size_t(end - first) * 128]);
    auto id = [&](int32_t t, int number) -> int32_t& { return ids[128 * size_t(t - first) + number]; };
    for (int y = 1; y < slab.rows() - 1; ++y)
        for (int x = 1; x < slab.columns() - 1; ++x) {
            int32_t t = slab.at(y, x);
            if (t < kTiles) continue;
            uint64_t of = slab.tiles().inside[t];
            uint64_t words[2] = {of ^ rights(of, slab.word(y, x + 1)), of ^ uppers(of, slab.word(y + 1, x))};
            for (uint64_t w = words[0] | words[1]; w; w &= w - 1)
                slab.crossed(t, w & -w, [&, t = t](int number, float a, float b) {
                    id(t, number) = int32_t(result.edges.size());
                    result.edges.push_back({kTile * (x - 1) + (number & 7), kTile * (y - 1) + (number >> 3 & 7), number >> 6, -1});
                    result.ends.push_back(a);
                    result.ends.push_back(b);
                });
        }
    for (int y = 1; y < slab.rows() - 1; ++y)
        for (int x = 1; x < slab.columns() - 1; ++x) {
            int32_t t = slab.at(y, x);
            if (t < kTiles) continue;
            const Quad tiles(slab, {y, x, kEmpty});
            const Corners corners(slab, tiles);
            const Cells cells(slab, slab.scale(), tiles);
            for (uint64_t mixed = corners.mixed(); mixed; mixed &= mixed - 1) {
                int bit = std::countr_zero(mixed);
                int32_t right = (bit & 7) == 7 ? std::max(slab.at(y, x + 1), first) : t;
                int32_t upper = bit >> 3 == 7 ? std::max(slab.at(y + 1, x), first) : t;
                const int32_t e[4] = {id(t, bit), id(right, 64 + (bit & 56) + ((bit + 1) & 7)), id(upper, (bit + 8) & 63),
                                      id(t, 64 + bit)};
                link(cells.sides(bit), corners.signs(bit), e, result.edges);
            }
        }
    return result;
}

}  // namespace fracslice::slices
