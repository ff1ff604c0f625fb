#include "picture.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "band.h"
#include "in_rows.h"
#include "wide.h"

namespace fracslice {
namespace {

// A tile, its cells that are wholly inside, and those that are cut.
struct Tile {
    Quad tiles;
    Corners corners;
    uint64_t whole, cut;
    Levels levels;

    Tile(const Slab& slab, const Quad& at) : tiles(at), corners(slab, at) {
        const uint64_t sharp = slab.sharp[at.own];
        whole = corners.whole() & ~sharp, cut = corners.mixed() | sharp;
    }
};

// The same as a screen shows it.
struct Turned {
    uint64_t whole, cut;
    Levels levels;
};

#if defined(FRACSLICE_WIDE)
FRACSLICE_WIDE uint64_t turn_wide(uint64_t word, __m512i order) {
    return _mm512_movepi8_mask(_mm512_maskz_permutexvar_epi8(kAll, order, _mm512_movm_epi8(word)));
}
// from: where in the tile its cells are.
FRACSLICE_WIDE void turn_wide(const Tile& tile, const Levels& from, Turned& to) {
    const __m512i order = _mm512_loadu_si512(from.data());
    to.whole = turn_wide(tile.whole, order), to.cut = turn_wide(tile.cut, order);
    _mm512_storeu_si512(to.levels.data(), _mm512_maskz_permutexvar_epi8(kAll, order, _mm512_loadu_si512(tile.levels.data())));
}
#endif

// Turns tiles: their rows are rows of the picture, from above.
class Turn {
 public:
    explicit Turn(const View& view) : transposed_(view.transposed), reversed_(view.backwards), shown_(view.levels) {
        for (int at = 0; at < 64; ++at) {
            int row = kTile - 1 - (at >> 3), column = reversed_ ? kTile - 1 - (at & 7) : at & 7;
            if (transposed_) std::swap(row, column);
            from_[at] = uint8_t(kTile * row + column);
        }
        for (int level = 0; level < 256; ++level) plain_ &= shown_[level] == level;
    }
    void operator()(const Tile& tile, Turned& to) const {
#if defined(FRACSLICE_WIDE)
        if (kWide)
            turn_wide(tile, from_, to);
        else
#endif
            turn(tile, to);
        if (!plain_)
            for (uint8_t& level : to.levels) level = shown_[level];
    }

 private:
    uint64_t turned(uint64_t word) const {
        if (transposed_) word = transposed(word);
        word = __builtin_bswap64(word);
        return reversed_ ? mirrored(word) : word;
    }
    void turn(const Tile& tile, Turned& to) const {
        to.whole = turned(tile.whole), to.cut = turned(tile.cut);
        for (size_t at = 0; at < from_.size(); ++at) to.levels[at] = tile.levels[from_[at]];
    }

    bool transposed_, reversed_, plain_ = true;
    std::array<uint8_t, 256> shown_;
    Levels from_;
};

// The layer's pixels along a side of the picture, in its order, counted from the first tile's: those from `first` to before
// `last` are on the screen, from `at` on.
struct Axis {
    int tiles, first, last, at;

    Axis(int places, int shape, int place, int room, bool backwards) : tiles(places - 2) {
        first = std::max(0, -place), last = std::max(std::min(shape, room - place), first), at = place + first;
        if (!backwards) return;
        int end = kTile * tiles;
        at = room - place - last;
        first = std::exchange(last, end - first), first = end - first;
    }
    int count() const { return last - first; }
};

// Memory of one picture after the other.
thread_local Runs runs_of_thread;

// A layer on its way to a picture.
class Shown {
 public:
    Shown(const Slab& slab, const View& view)
        : slab_(slab), view_(view), turn_(view),
          down_(side(view.transposed), view.shape[view.transposed], view.at[view.transposed], view.rows, true),
          across_(side(!view.transposed), view.shape[!view.transposed], view.at[!view.transposed], view.columns, view.backwards),
          band_(across_.tiles, across_.first, across_.last), coverage_(slab),
          rows_(slab, view, down_.tiles, across_.tiles) {}

    Picture picture() {
        const uint64_t row = uint64_t(view_.columns) + 1;
        int64_t at = int64_t(row) * down_.at + 1 + across_.at;  // place of a row's first pixel among all bytes
        runs_.clear();
        runs_.add(0, row * down_.at);
        for (int tile = down_.first / kTile; tile * kTile < down_.last; ++tile) {
            int from = std::max(down_.first - tile * kTile, 0), to = std::min(down_.last - tile * kTile, kTile);
            band_.clear(from, to, at, row);
            at += int64_t(row) * (to - from);
            if (read(tile))
                band_.write(uint32_t(across_.at) + 1, uint32_t(view_.columns - across_.at - across_.count()), runs_);
            else
                runs_.add(0, row * (to - from));
        }
        runs_.add(0, row * (view_.rows - down_.at - down_.count()));
        painted_.area += coverage_.area();
        return {&runs_.zlib(band_.checksum(row * uint64_t(view_.rows))), painted_};
    }

 private:
    int side(bool along_x) const { return along_x ? slab_.columns() : slab_.rows(); }

    // Reads the tiles of eight rows; false if they are empty.
    bool read(int tile) {
        using Spot = InRows::Spot;
        const auto [begin, end] = rows_[tile];
        if (begin == end) return false;
        const int n = across_.tiles, along = down_.tiles - tile, beside = view_.backwards ? n : 1;
        const int32_t* first = view_.transposed ? slab_.spot(beside, along) : slab_.spot(along, beside);
        const ptrdiff_t step = (view_.transposed ? slab_.columns() : 1) * (view_.backwards ? -1 : 1);
        // All between two tiles is as the one after the first is; the same is before the first tile and after the last.
        int next = across_.first / kTile;  // tile that the band may lack
        auto put_next = [&](int i) {
            if (i == next && i < n) band_.put(i, slab_.inside[first[step * i]] & 1), ++next;
        };
        if (next < n && next < begin->across) put_next(next);
        cover(begin, end, first, step);
        for (const Spot* spot = begin; spot != end; ++spot) {
            const int i = spot->across, after = spot + 1 == end ? n : spot[1].across;
            if (put(row_[size_t(spot - begin)], i)) next = std::max(next, i + 1);
            put_next(i);
            if (i + 1 == after) continue;
            put_next(i + 1);
            if (first[step * (i + 1)] == kFull) painted_.area += kTile * kTile * double(after - i - 1);
        }
        band_.close();
        return true;
    }

    // Reads tiles, and covers those that are cut: one after the other, for the next begins before one is done.
    void cover(const InRows::Spot* begin, const InRows::Spot* end, const int32_t* first, ptrdiff_t step) {
        row_.clear(), cut_.resize(size_t(end - begin));
        int* cut = cut_.data();
        for (const auto* spot = begin; spot != end; ++spot) {
            const float* values = slab_.values[spot->tile].data();
            for (int i = 0; i < 64; i += 16) __builtin_prefetch(values + i);
            row_.emplace_back(slab_, Quad(first + step * spot->across, slab_.columns()));
            *cut = int(spot - begin), cut += row_.back().cut != 0;
        }
        for (const int* k = cut_.data(); k != cut; ++k) coverage_(row_[*k].tiles, row_[*k].corners, row_[*k].levels);
    }

    // Whether it is cut.
    bool put(const Tile& tile, int i) {
        if (!tile.cut) {
            painted_.area += __builtin_popcountll(tile.whole);
            return false;
        }
        painted_.partly += __builtin_popcountll(tile.cut);
        turn_(tile, turned_);
        band_.put(i, turned_.whole, turned_.cut, turned_.levels);
        return true;
    }

    const Slab& slab_;
    const View& view_;
    Turn turn_;
    Axis down_, across_;
    Band band_;
    Coverage coverage_;
    Rows<Tile> row_;
    Rows<int> cut_;
    Turned turned_;
    InRows rows_;
    Runs& runs_ = runs_of_thread;
    Painted painted_{0, 0};
};

}  // namespace

Picture picture(const Slab& slab, const View& view) { return Shown(slab, view).picture(); }

const Rows<uint8_t>& deflated(const Canvas& image) {
    Runs& runs = runs_of_thread;
    runs.clear();
    Adler sum;
    const int64_t stride = image.columns + 1;
    for (int y = 0; y < image.rows; ++y) {
        runs.add(0, 1);
        const uint8_t* row = image.data + y * image.down;
        for (int x = 0, begin = 0; x < image.columns; begin = x) {
            const uint8_t value = row[x * image.across];
            while (++x < image.columns && row[x * image.across] == value) {}
            runs.add(value, uint64_t(x - begin));
            sum.add(value, uint64_t(y * stride + 1 + begin), uint64_t(x - begin));
        }
    }
    return runs.zlib(sum.value(uint64_t(stride) * uint64_t(image.rows)));
}

}  // namespace fracslice
