#include <algorithm>
#include <bit>

#include "coverage.h"
#include "marching_squares.h"

namespace fracslice::slices {
namespace {

constexpr uint8_t kSolid = 128;  // the coverage from which a pixel is solid

// Eight rows of pixels, tile by tile, that become runs.
class Turns {
 public:
    // The next tile, which begins at a column: its solid pixels.
    void add(int column, uint64_t solid) {
        if (solid == within_) return;
        for (int row = 0; row < kTile; ++row) {
            uint8_t bits = uint8_t(solid >> kTile * row), before = uint8_t(within_ >> kTile * row);
            for (unsigned turns = (bits ^ (bits << 1 | before >> 7)) & 0xFF; turns; turns &= turns - 1)
                columns_[row].push_back(column + std::countr_zero(turns));
        }
        within_ = ((solid & kLastColumn) >> 7) * 0xFF;
    }
    // After the last tile: the runs of the first `rows` rows.
    void end(int column, int rows, SolidRuns& result) {
        add(column, 0);
        for (int row = 0; row < kTile; ++row) {
            auto& turns = columns_[row];
            for (size_t i = 0; row < rows && i < turns.size(); i += 2) result.runs.push_back({turns[i], turns[i + 1]});
            if (row < rows) result.rows.push_back(int32_t(result.runs.size()));
            turns.clear();
        }
    }

 private:
    std::array<std::vector<int32_t>, kTile> columns_;  // columns where solid pixels begin or end, in turn
    uint64_t within_ = 0;                            // the rows in which a run has begun, a byte each
};

}  // namespace

SolidRuns solid_runs(const Slab& slab, int rows, int columns) {
    SolidRuns result{{0}, {}, {0, 0}};
    Coverage coverage(slab);
    Levels levels;
    Turns turns;
    int64_t full = 0;
    for (int y = 1; kTile * (y - 1) < rows; ++y) {
        for (int x = 1; kTile * (x - 1) < columns; ++x) {
            const int32_t t = slab.at(y, x);
            const Quad tiles(slab, {y, x, kEmpty});
            const Corners corners(slab, tiles);
            const uint64_t sharp = slab.tiles().sharp[t], cut = t < kTiles ? 0 : corners.mixed() | sharp;
            const bool whole = t != kEmpty && corners.whole() == kAll && !sharp;
            uint64_t solid = whole ? kAll : 0;
            full += whole;
            if (cut) {
                coverage(tiles, corners, levels);
                result.painted.partly += std::popcount(cut);
                each(cut | corners.whole(), [&](int bit) { solid |= uint64_t(levels[bit] >= kSolid) << bit; });
            }
            const int left = columns - kTile * (x - 1);
            turns.add(kTile * (x - 1), left < kTile ? solid & kAll / 255 * (0xFF >> (kTile - left)) : solid);
        }
        turns.end(columns, std::min(rows - kTile * (y - 1), kTile), result);
    }
    result.painted.area = coverage.area() + kTile * kTile * double(full);
    return result;
}

}  // namespace fracslice::slices
