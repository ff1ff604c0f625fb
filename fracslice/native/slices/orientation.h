// Tiles side by side as rows of pixels, as a screen shows them.
#pragma once
#include <array>
#include <cstring>

#include "../compiler.h"
#include "bits.h"
#include "coverage.h"

namespace fracslice::slices {

// Turns tiles: their rows are rows of the picture, from above.
class Orientation {
 public:
    // shown: levels as they are shown, by the coverage.
    Orientation(bool transposed, bool backwards, const std::array<uint8_t, 256>& shown)
        : transposed_(transposed), reversed_(backwards), shown_(shown) {
        for (int level = 0; level < 256; ++level) plain_ &= shown_[level] == level;
    }
    // n tiles as eight rows, `stride` bytes from row to row.
    void operator()(Levels* tiles, int n, uint8_t* rows, ptrdiff_t stride) const {
        for (int i = 0; i < n; ++i, rows += kTile) {
            if (!plain_)
                for (uint8_t& level : tiles[i]) level = shown_[level];
            uint64_t eight[8];
            std::memcpy(eight, tiles[i].data(), sizeof eight);
            if (transposed_) swap_rows_and_columns(eight);
            for (int row = 0; row < kTile; ++row) {
                const uint64_t bytes = reversed_ ? byteswapped(eight[kTile - 1 - row]) : eight[kTile - 1 - row];
                std::memcpy(rows + row * stride, &bytes, sizeof bytes);
            }
        }
    }
    // A bit for each cell, a word for each of n tiles, as eight words for eight rows of eight tiles, and so on.
    void operator()(const uint64_t* words, int n, uint64_t* rows) const {
        for (int i = 0; i < n; i += 8) {
            for (int k = i; k < i + 8; ++k) rows[k] = turned(words[k]);
            swap_rows_and_columns(std::span<uint64_t, 8>(rows + i, 8));
        }
    }

 private:
    uint64_t turned(uint64_t word) const {
        if (transposed_) word = transposed(word);
        word = byteswapped(word);
        return reversed_ ? mirrored(word) : word;
    }

    bool transposed_, reversed_, plain_ = true;
    std::array<uint8_t, 256> shown_;
};

}  // namespace fracslice::slices
