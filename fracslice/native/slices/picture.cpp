#include "picture.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "../compiler.h"
#include "band.h"
#include "tile_rows.h"

namespace fracslice::slices {
namespace {

// A tile of which some cells are cut, and where their levels go.
struct Cut {
    Quad tiles;
    Corners corners;
    Levels* levels;
};

// The layer's pixels along a side of the picture, in its order, counted from the first tile's: those from `first` to before
// `last` are on the screen, from `at` on.
struct Axis {
    int tiles, first, last, at;

    Axis(int places, int shape, int place, int size, bool backwards) : tiles(places - 2) {
        first = std::max(0, -place), last = std::max(std::min(shape, size - place), first), at = place + first;
        if (!backwards) return;
        int end = kTile * tiles;
        at = size - place - last;
        first = std::exchange(last, end - first), first = end - first;
    }
    int count() const { return last - first; }
};

// Memory of one picture after the other.
thread_local Runs runs_of_thread;

// A layer on its way to a picture.
class Shown {
 public:
    Shown(const Slab& slab, const View& view, Encoding encoding)
        : slab_(slab), view_(view), encoding_(encoding), filter_(encoding == Encoding::png),
          down_(side(view.transposed), view.shape[view.transposed], view.at[view.transposed], view.rows, true),
          across_(side(!view.transposed), view.shape[!view.transposed], view.at[!view.transposed], view.columns, view.backwards),
          band_(Orientation(view.transposed, view.backwards, view.levels), across_.tiles, across_.first, across_.last), coverage_(slab),
          rows_(slab, view, down_.tiles, across_.tiles) {}

    Picture picture() {
        const uint64_t row = uint64_t(view_.columns) + filter_;
        uint64_t at = row * down_.at + filter_ + across_.at;  // place of a row's first pixel among all bytes
        runs_.clear();
        runs_.add(0, row * down_.at);
        for (int tile = down_.first / kTile; tile * kTile < down_.last; ++tile) {
            int from = std::max(down_.first - tile * kTile, 0), to = std::min(down_.last - tile * kTile, kTile);
            band_.clear(from, to, at, row);
            at += row * (to - from);
            if (read(tile))
                band_.write(uint32_t(across_.at) + filter_, uint32_t(view_.columns - across_.at - across_.count()), runs_);
            else
                runs_.add(0, row * (to - from));
        }
        runs_.add(0, row * (view_.rows - down_.at - down_.count()));
        painted_.area += coverage_.area();
        if (encoding_ != Encoding::png) return {&run_lengths(runs_, encoding_), painted_};
        return {&runs_.zlib(band_.checksum(row * uint64_t(view_.rows))), painted_};
    }

 private:
    int side(bool along_x) const { return along_x ? slab_.columns() : slab_.rows(); }

    // Reads the tiles of eight rows; false if they are empty.
    bool read(int tile) {
        using Spot = TileRows::Spot;
        const auto [begin, end] = rows_[tile];
        if (begin == end) return false;
        const int n = across_.tiles, along = down_.tiles - tile, beside = view_.backwards ? n : 1;
        const int32_t* first = view_.transposed ? slab_.spot(beside, along) : slab_.spot(along, beside);
        const ptrdiff_t step = (view_.transposed ? slab_.columns() : 1) * (view_.backwards ? -1 : 1);
        // All between two tiles is as the one after the first is; the same is before the first tile and after the last.
        int next = across_.first / kTile;  // tile that the band may lack
        auto put_next = [&](int i) {
            if (i == next && i < n) band_.uniform(i, slab_.tiles().inside[first[step * i]] & 1), ++next;
        };
        if (next < n && first[step * next] < kTiles) put_next(next);
        cut_.clear();
        for (const Spot* spot = begin; spot != end; ++spot) {
            const int i = spot->across, after = spot + 1 == end ? n : spot[1].across;
            if (put(i, first + step * i)) next = std::max(next, i + 1);
            put_next(i);
            if (i + 1 == after) continue;
            put_next(i + 1);
            if (first[step * (i + 1)] == kFull) painted_.area += kTile * kTile * double(after - i - 1);
        }
        for (const Cut& cut : cut_) coverage_(cut.tiles, cut.corners, *cut.levels);
        band_.close();
        return true;
    }

    // Whether the tile is cut.
    bool put(int i, const int32_t* spot) {
        const Quad tiles(spot, slab_.columns());
        const Corners corners(slab_, tiles);
        const uint64_t cut = corners.mixed() | slab_.tiles().sharp[tiles.own];
        if (!cut) {
            painted_.area += std::popcount(corners.whole());
            return false;
        }
        const float* values = slab_.tiles().values[tiles.own].data();
        for (int k = 0; k < 64; k += 16) prefetch(values + k);
        painted_.partly += std::popcount(cut);
        cut_.push_back({tiles, corners, &band_.cut(i, cut)});
        return true;
    }

    const Slab& slab_;
    const View& view_;
    Encoding encoding_;
    uint32_t filter_;  // bytes before each row
    Axis down_, across_;
    Band band_;
    Coverage coverage_;
    Rows<Cut> cut_;
    TileRows rows_;
    Runs& runs_ = runs_of_thread;
    Painted painted_{0, 0};
};

}  // namespace

Picture picture(const Slab& slab, const View& view, Encoding encoding) { return Shown(slab, view, encoding).picture(); }

const Rows<uint8_t>& encoded(const Canvas& image, Encoding encoding) {
    Runs& runs = runs_of_thread;
    runs.clear();
    Adler sum;
    const int filter = encoding == Encoding::png;
    const int64_t stride = image.columns + filter;
    for (int y = 0; y < image.rows; ++y) {
        runs.add(0, uint64_t(filter));
        const uint8_t* row = image.data + y * image.down;
        for (int x = 0, begin = 0; x < image.columns; begin = x) {
            const uint8_t value = row[x * image.across];
            while (++x < image.columns && row[x * image.across] == value) {}
            runs.add(value, uint64_t(x - begin));
            sum.add(value, uint64_t(y * stride + filter + begin), uint64_t(x - begin));
        }
    }
    if (encoding != Encoding::png) return run_lengths(runs, encoding);
    return runs.zlib(sum.value(uint64_t(stride) * uint64_t(image.rows)));
}

}  // namespace fracslice::slices
