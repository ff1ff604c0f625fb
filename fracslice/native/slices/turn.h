// Tiles side by side as rows of pixels, as a screen shows them.
#pragma once
#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "coverage.h"
#include "wide.h"

namespace fracslice {

// Turns tiles: their rows are rows of the picture, from above.
class Turn {
 public:
    // shown: levels as they are shown, by the coverage.
    Turn(bool transposed, bool backwards, const std::array<uint8_t, 256>& shown)
        : transposed_(transposed), reversed_(backwards), shown_(shown) {
        for (int at = 0; at < 64; ++at) {
            int row = kTile - 1 - (at >> 3), column = reversed_ ? kTile - 1 - (at & 7) : at & 7;
            if (transposed_) std::swap(row, column);
            from_[at] = uint8_t(kTile * row + column);
        }
        for (int level = 0; level < 256; ++level) plain_ &= shown_[level] == level;
    }
    // n tiles as eight rows, `stride` bytes from row to row.
    void operator()(Levels* tiles, int n, uint8_t* rows, ptrdiff_t stride) const {
        for (int i = 0; !plain_ && i < n; ++i)
            for (uint8_t& level : tiles[i]) level = shown_[level];
#if defined(FRACSLICE_WIDE)
        if (kWide) return turn_wide(tiles, n, from_, rows, stride);
#endif
        for (; n > 0; --n, ++tiles, rows += kTile)
            for (int at = 0; at < 64; ++at) rows[at / kTile * stride + at % kTile] = (*tiles)[from_[at]];
    }
    // A bit for each cell, a word for each of n tiles, as eight words for eight rows of eight tiles, and so on.
    void operator()(const uint64_t* words, int n, uint64_t* rows) const {
        for (int i = 0; i < n; i += 8) {
#if defined(FRACSLICE_WIDE)
            if (kWide)
                turn_wide(words + i, from_, rows + i);
            else
#endif
                turn(words + i, rows + i);
        }
    }

 private:
    uint64_t turned(uint64_t word) const {
        if (transposed_) word = fracslice::transposed(word);
        word = __builtin_bswap64(word);
        return reversed_ ? mirrored(word) : word;
    }
    // Eight words.
    void turn(const uint64_t* words, uint64_t* rows) const {
        std::fill_n(rows, 8, 0);
        for (int i = 0; i < 8; ++i) {
            const uint64_t word = turned(words[i]);
            for (int row = 0; row < kTile; ++row) rows[row] |= (word >> kTile * row & 0xFF) << kTile * i;
        }
    }
#if defined(FRACSLICE_WIDE)
    FRACSLICE_WIDE static void turn_wide(const Levels* tiles, int n, const Levels& from, uint8_t* rows, ptrdiff_t stride) {
        const __m512i order = _mm512_loadu_si512(from.data());
        for (; n > 0; --n, ++tiles, rows += kTile) {
            alignas(64) uint8_t turned[64];
            _mm512_store_si512(turned, _mm512_maskz_permutexvar_epi8(kAll, order, _mm512_loadu_si512(tiles->data())));
            for (int row = 0; row < kTile; ++row) std::memcpy(rows + row * stride, turned + kTile * row, kTile);
        }
    }
    FRACSLICE_WIDE static void turn_wide(const uint64_t* words, const Levels& from, uint64_t* rows) {
        const __m512i order = _mm512_loadu_si512(from.data());
        alignas(64) uint64_t eight[8];
        alignas(64) uint8_t columns[64];
        for (int i = 0; i < 8; ++i)
            eight[i] = _mm512_movepi8_mask(_mm512_maskz_permutexvar_epi8(kAll, order, _mm512_movm_epi8(words[i])));
        for (int at = 0; at < 64; ++at) columns[at] = uint8_t(8 * (at % 8) + at / 8);
        const __m512i bytes = _mm512_maskz_permutexvar_epi8(kAll, _mm512_load_si512(columns), _mm512_load_si512(eight));
        _mm512_storeu_si512(rows, bytes);
    }
#endif

    bool transposed_, reversed_, plain_ = true;
    std::array<uint8_t, 256> shown_;
    Levels from_;
};

}  // namespace fracslice
