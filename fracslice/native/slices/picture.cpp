#include "picture.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "coverage.h"
#include "deflate.h"
#include "in_rows.h"
#include "wide.h"

#if defined(FRACSLICE_WIDE)
#include <immintrin.h>
#endif

namespace fracslice {
namespace {

// The bytes that `from` names.
void permute_each(const Levels& levels, const Levels& from, Levels& to) {
    for (size_t at = 0; at < to.size(); ++at) to[at] = levels[from[at]];
}
#if defined(FRACSLICE_WIDE)
FRACSLICE_WIDE void permute_wide(const Levels& levels, const Levels& from, Levels& to) {
    const __m512i order = _mm512_loadu_si512(from.data()), bytes = _mm512_loadu_si512(levels.data());
    _mm512_storeu_si512(to.data(), _mm512_maskz_permutexvar_epi8(kAll, order, bytes));
}
const auto permute = has_wide() ? permute_wide : permute_each;
#else
constexpr auto permute = permute_each;
#endif

// A tile as a screen shows it: its rows are rows of the picture, from above.
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
    uint64_t operator()(uint64_t word) const {
        if (transposed_) word = transposed(word);
        word = __builtin_bswap64(word);
        return reversed_ ? mirrored(word) : word;
    }
    void operator()(const Levels& levels, Levels& to) const {
        permute(levels, from_, to);
        if (!plain_)
            for (uint8_t& level : to) level = shown_[level];
    }

 private:
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

// Eight rows of a picture, from its column `first` to before `last`: of the tiles the first, those that are cut, and the one
// after each of these. All else is as its left neighbour.
class Band {
 public:
    Band(int tiles, int first, int last)
        : first_(first), last_(last), room_(tiles / 8 * 8 + 16), column_(room_), whole_(room_), cut_(kTile * room_),
          levels_(kTile * stride() + Runs::kAtOnce), ends_(kTile * room_ + 2) {}

    void clear() { n_ = 0; }
    // The tile as the next one, if it is on the picture.
    void put(int tile, uint64_t whole, uint64_t cut, const Levels& levels) {
        const int column = kTile * tile;
        if (column <= first_ - kTile || column >= last_) return;
        if (column < first_) cut &= kAll / 255 * (0xFF & 0xFF << (first_ - column));
        if (column > last_ - kTile) cut &= kAll / 255 * (0xFF >> (column + kTile - last_));
        uint8_t *rows = &cut_[n_], *to = &levels_[kTile * n_];
        for (int row = 0; row < kTile; ++row) {
            rows[row * room_] = uint8_t(cut >> kTile * row);
            std::memcpy(to + row * stride(), &levels[kTile * row], kTile);
        }
        column_[n_] = column, whole_[n_++] = whole;
    }
    // One that is not cut.
    void put(int tile, bool inside) {
        if (kTile * tile <= first_ - kTile || kTile * tile >= last_) return;
        for (int row = 0; row < kTile; ++row) cut_[n_ + row * room_] = 0;
        column_[n_] = kTile * tile, whole_[n_++] = inside ? kAll : 0;
    }
    void close() {
        column_[n_] = last_;
        for (int row = 0; row < kTile; ++row) std::memset(&cut_[row * room_ + n_], 0, kTile);
    }

    // Some of the rows, each after `before` zeros and before `after` ones.
    void write(int row, int end, uint32_t before, uint32_t after, Runs& runs) {
        spans_.resize(size_t(end - row) * (ends_.size() / 2 + 2));
        Span* span = spans_.data();
        uint8_t value = 0;
        uint32_t length = 0;  // of the run of this value, so far
        auto is = [&](uint8_t next) {
            if (value != next) *span++ = {value, length, 0, 0}, value = next, length = 0;
        };
        const int* column = column_.data();
        const uint64_t* whole = whole_.data();
        for (; row < end; ++row) {
            auto filled = [&](int at) { return uint8_t(-(whole[at >> 3] >> (kTile * row + (at & 7)) & 1)); };
            is(0);
            length += before;
            is(filled(first_ & 7));
            int begin = first_ - int(length);
            const int* ends = ends_.data();
            for (const int* stop = turns(row); ends != stop; ends += 2) {
                const int from = ends[0], to = ends[1];
                const int at = column[from >> 3] + (from & 7);
                *span++ = {value, uint32_t(at - begin), uint32_t(row * stride() + from), uint32_t(to - from)};
                begin = column[to >> 3] + (to & 7), value = filled(to);
            }
            length = uint32_t(last_ - begin);
            is(0);
            length += after;
        }
        runs.add(spans_.data(), size_t(span - spans_.data()), levels_.data());
        runs.add(0, length);
    }

 private:
    // From row to row of the levels.
    int stride() const { return kTile * room_; }
    // Where in a row pixels begin to be cut, and where they end to be, by turns; returns the end.
    const int* turns(int row) {
        const uint8_t* cut = &cut_[row * room_];
        int* end = ends_.data();
        uint64_t before = 0;
        for (int i = 0; i <= n_; i += 8) {
            uint64_t word;
            std::memcpy(&word, cut + i, 8);
            each(word ^ (word << 1 | before), [&](int bit) { *end++ = kTile * i + bit; });
            before = word >> 63;
        }
        return end;
    }

    int first_, last_, room_, n_ = 0;
    std::vector<int> column_;
    std::vector<uint64_t> whole_;
    std::vector<uint8_t> cut_, levels_;
    std::vector<int> ends_;
    Rows<Span> spans_;
};

constexpr int kAhead = 3;  // tiles

// A layer on its way to a picture.
class Shown {
 public:
    Shown(const Slab& slab, int layer, const View& view)
        : slab_(slab), layer_(layer), view_(view), turn_(view),
          down_(side(view.transposed), view.shape[view.transposed], view.at[view.transposed], view.rows, true),
          across_(side(!view.transposed), view.shape[!view.transposed], view.at[!view.transposed], view.columns, view.backwards),
          band_(across_.tiles, across_.first, across_.last), coverage_(slab, layer),
          rows_(slab, layer, view, down_.tiles, across_.tiles) {}

    Picture picture() {
        const uint64_t row = uint64_t(view_.columns) + 1;
        runs_.add(0, row * down_.at);
        for (int tile = down_.first / kTile; tile * kTile < down_.last; ++tile) {
            int from = std::max(down_.first - tile * kTile, 0), to = std::min(down_.last - tile * kTile, kTile);
            if (!read(tile)) {
                runs_.add(0, row * (to - from));
                continue;
            }
            band_.write(from, to, uint32_t(across_.at) + 1, uint32_t(view_.columns - across_.at - across_.count()), runs_);
        }
        runs_.add(0, row * (view_.rows - down_.at - down_.count()));
        return {runs_.zlib(), painted_};
    }

 private:
    int side(bool along_x) const { return along_x ? slab_.columns() : slab_.rows(); }

    // Reads the tiles of eight rows; false if they are empty.
    bool read(int tile) {
        using Spot = InRows::Spot;
        const auto [begin, end] = rows_[tile];
        if (begin == end) return false;
        const int n = across_.tiles, along = down_.tiles - tile, beside = view_.backwards ? n : 1;
        const int32_t* first = view_.transposed ? slab_.spot(layer_, beside, along) : slab_.spot(layer_, along, beside);
        const ptrdiff_t step = (view_.transposed ? slab_.columns() : 1) * (view_.backwards ? -1 : 1);
        band_.clear();
        // All between two tiles is as the one after the first is; the same is before the first tile and after the last.
        int next = across_.first / kTile;  // tile that the band may lack
        auto put = [&](int i) {
            if (i == next && i < n) band_.put(i, slab_.inside[first[step * i]] & 1), ++next;
        };
        if (next < n && next < begin->across) put(next);
        for (const Spot* spot = begin; spot != end; ++spot) {
            fetch(spot[std::min<ptrdiff_t>(kAhead, end - 1 - spot)].tile);
            const int i = spot->across, after = spot + 1 == end ? n : spot[1].across;
            if (read(Quad(first + step * i, slab_.columns()), i)) next = std::max(next, i + 1);
            put(i);
            if (i + 1 == after) continue;
            put(i + 1);
            if (first[step * (i + 1)] == kFull) painted_.area += kTile * kTile * double(after - i - 1);
        }
        band_.close();
        return true;
    }

    // A tile is needed soon.
    void fetch(int32_t t) const {
        const float* values = slab_.values[t].data();
        for (int i = 0; i < 64; i += 16) __builtin_prefetch(values + i);
    }

    // Whether it is cut.
    bool read(const Quad& tiles, int i) {
        const Corners corners(slab_, tiles);
        const uint64_t sharp = slab_.sharp[tiles.own], whole = corners.whole() & ~sharp, cut = corners.mixed() | sharp;
        if (!cut) {
            painted_.area += __builtin_popcountll(whole);
            return false;
        }
        painted_.area += coverage_(tiles, corners, levels_);
        painted_.partly += __builtin_popcountll(cut);
        turn_(levels_, turned_);
        band_.put(i, turn_(whole), turn_(cut), turned_);
        return true;
    }

    const Slab& slab_;
    int layer_;
    const View& view_;
    Turn turn_;
    Axis down_, across_;
    Band band_;
    Coverage coverage_;
    Levels levels_, turned_;
    InRows rows_;
    Runs runs_;
    Painted painted_{0, 0};
};

}  // namespace

Picture picture(const Slab& slab, int layer, const View& view) { return Shown(slab, layer, view).picture(); }

std::vector<uint8_t> deflated(const Canvas& image) {
    Runs runs;
    for (int y = 0; y < image.rows; ++y) {
        runs.add(0, 1);
        const uint8_t* row = image.data + y * image.down;
        for (int x = 0, begin = 0; x < image.columns; begin = x) {
            const uint8_t value = row[x * image.across];
            while (++x < image.columns && row[x * image.across] == value) {}
            runs.add(value, uint64_t(x - begin));
        }
    }
    return runs.zlib();
}

}  // namespace fracslice
