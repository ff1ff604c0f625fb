// Words of 64 signs: shifts that bring each sample's neighbour to its place.
#pragma once
#include <cstdint>

namespace fracslice {

constexpr uint64_t kFirstColumn = 0x0101010101010101, kLastColumn = 0x8080808080808080;
constexpr uint64_t kFirstRow = 0xFF, kLastRow = 0xFF00000000000000;

inline int lowest(uint64_t word) { return __builtin_ctzll(word); }

// The sign of the sample to the right of each, to the left of it, above and below it; `beside`: the word of the tile there.
inline uint64_t rights(uint64_t word, uint64_t beside) { return (word >> 1 & ~kLastColumn) | (beside << 7 & kLastColumn); }
inline uint64_t lefts(uint64_t word, uint64_t beside) { return (word << 1 & ~kFirstColumn) | (beside >> 7 & kFirstColumn); }
inline uint64_t uppers(uint64_t word, uint64_t beside) { return word >> 8 | beside << 56; }
inline uint64_t lowers(uint64_t word, uint64_t beside) { return word << 8 | beside >> 56; }

// The samples of a block of size x size.
inline uint64_t block_mask(int size, int y, int x) {
    uint64_t line = (uint64_t(0xFF) >> (8 - size)) << x, mask = 0;
    for (int r = y; r < y + size; ++r) mask |= line << 8 * r;
    return mask;
}

}  // namespace fracslice
