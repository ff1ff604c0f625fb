// Words of 64 signs: shifts that bring each sample's neighbour to its place.
#pragma once
#include <bit>
#include <cstdint>
#include <span>

namespace fracslice::slices {

constexpr uint64_t kFirstColumn = 0x0101010101010101, kLastColumn = 0x8080808080808080;
constexpr uint64_t kFirstRow = 0xFF, kLastRow = 0xFF00000000000000;

// The sign of the sample to the right of each, to the left of it, above and below it; `beside`: the word of the tile there.
inline uint64_t rights(uint64_t word, uint64_t beside) { return (word >> 1 & ~kLastColumn) | (beside << 7 & kLastColumn); }
inline uint64_t lefts(uint64_t word, uint64_t beside) { return (word << 1 & ~kFirstColumn) | (beside >> 7 & kFirstColumn); }
inline uint64_t uppers(uint64_t word, uint64_t beside) { return word >> 8 | beside << 56; }
inline uint64_t lowers(uint64_t word, uint64_t beside) { return word << 8 | beside >> 56; }

// visit(bit) for each bit of a word, ascending.
template <class Visit>
inline void each(uint64_t word, const Visit& visit) {
    for (; word; word &= word - 1) visit(std::countr_zero(word));
}

// The word with each row's columns from right to left, and with rows as columns (Warren 2012, "Hacker's Delight", 7-3).
inline uint64_t mirrored(uint64_t w) {
    w = (w >> 1 & 0x5555555555555555) | (w & 0x5555555555555555) << 1;
    w = (w >> 2 & 0x3333333333333333) | (w & 0x3333333333333333) << 2;
    return (w >> 4 & 0x0F0F0F0F0F0F0F0F) | (w & 0x0F0F0F0F0F0F0F0F) << 4;
}
inline uint64_t transposed(uint64_t w) {
    auto swap = [&](uint64_t mask, int by) {
        uint64_t t = (w ^ w >> by) & mask;
        w ^= t ^ t << by;
    };
    swap(0x00AA00AA00AA00AA, 7);
    swap(0x0000CCCC0000CCCC, 14);
    swap(0x00000000F0F0F0F0, 28);
    return w;
}

// Eight words of eight bytes: the first bytes of all become the first word, and so on.
inline void swap_rows_and_columns(std::span<uint64_t, 8> w) {
    auto swap = [&](int apart, uint64_t mask) {
        for (int i = 0; i < 8; ++i) {
            if (i & apart) continue;
            uint64_t t = (w[i] >> 8 * apart ^ w[i + apart]) & mask;
            w[i + apart] ^= t, w[i] ^= t << 8 * apart;
        }
    };
    swap(4, 0x00000000FFFFFFFF);
    swap(2, 0x0000FFFF0000FFFF);
    swap(1, 0x00FF00FF00FF00FF);
}

// The samples of odd rows and columns, a row of four in each byte; and such samples as the blocks of 2 x 2 that end there.
inline uint32_t halved(uint64_t w) {
    w = w >> 9 & 0x0055005500550055;
    w = (w | w >> 1) & 0x0033003300330033, w = (w | w >> 2) & 0x000F000F000F000F;
    w |= w >> 8;
    return uint32_t(w & 0xFFFF) | uint32_t(w >> 32) << 16;
}
inline uint64_t doubled(uint32_t halves) {
    uint64_t w = (halves & 0xFFFF) | uint64_t(halves & 0xFFFF0000) << 16;
    w = (w | w << 8) & 0x00FF00FF00FF00FF;
    w = (w | w << 2) & 0x0033003300330033, w = (w | w << 1) & 0x0055005500550055;
    return w * 0x0303;
}
// Those of the first four rows and columns of which five rows and columns from there on are all ones.
inline uint32_t all_of_five(uint64_t w) {
    uint64_t row = w & w >> 1;
    row &= row >> 2 & w >> 4;
    uint64_t all = row & row >> 8;
    all &= all >> 16 & row >> 32;
    return uint32_t(all) & 0x0F0F0F0F;
}

// The samples of a block of size x size, the first of a tile.
constexpr uint64_t block(int size) {
    uint64_t line = (uint64_t(1) << size) - 1, word = 0;
    for (int row = 0; row < size; ++row) word |= line << 8 * row;
    return word;
}

}  // namespace fracslice::slices
