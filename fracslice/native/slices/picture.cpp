#include "picture.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <utility>
#include <vector>

#include "../compiler.h"
#include "avx512.h"
#include "coverage.h"

namespace fracslice::slices {

// --- Tiles side by side as rows of pixels, as a screen shows them.

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

// --- Eight rows of a picture on their way to a string of bytes.

// The numbers of bits that differ from the one before, of n words that are eight words apart; returns the end. Up to `kSlack`
// numbers behind the end are written.
inline int* turns_each(const uint64_t* words, int n, int* end) {
    uint64_t before = 0;
    for (int i = 0; i < n; ++i) {
        const uint64_t word = words[8 * i];
        each(word ^ (word << 1 | before), [&](int bit) { *end++ = 64 * i + bit; });
        before = word >> 63;
    }
    return end;
}
#if defined(FRACSLICE_WIDE)
FRACSLICE_WIDE inline int* turns_wide(const uint64_t* words, int n, int* end) {
    uint64_t before = 0;
    for (int i = 0; i < n; ++i) {
        const uint64_t word = words[8 * i];
        const SetBits turns(word ^ (word << 1 | before));
        before = word >> 63;
        for (int at = 0; at < turns.count; at += 16)
            _mm512_storeu_si512(end + at, _mm512_add_epi32(turns.sixteen(at), _mm512_set1_epi32(64 * i)));
        end += turns.count;
    }
    return end;
}
inline const auto find_turns = kWide ? turns_wide : turns_each;
#else
inline constexpr auto find_turns = turns_each;
#endif

// Eight rows of a picture, from its column `first` to before `last`: of the tiles the first, those that are cut, and the one
// after each of these. All else is as its left neighbour.
class Band {
 public:
    Band(const Orientation& orientation, int tiles, int first, int last)
        : orientation_(orientation), first_(first), last_(last), capacity_(tiles / 8 * 8 + 16), column_(capacity_), tiles_(capacity_),
          cut_(capacity_), cut_rows_(capacity_), levels_(size_t(kTile * stride())), ends_(kTile * capacity_ + 2 + kSlack) {}

    // Begins with eight rows of which those from `from` to before `to` are on the picture; `at`: the place of the first one's
    // first byte among all bytes, `across` from row to row.
    void clear(int from, int to, uint64_t at, uint64_t across) { n_ = 0, from_ = from, to_ = to, at_ = at, across_ = across; }
    // A tile of which some cells are cut as the next one, if it is on the picture. Its levels are to be set before the end.
    Levels& cut(int tile, uint64_t cells) {
        column_[n_] = kTile * tile, cut_[n_] = cells;
        return tiles_[on(tile) ? n_++ : capacity_ - 1];
    }
    // One that is not cut.
    void uniform(int tile, bool inside) {
        if (!on(tile)) return;
        column_[n_] = kTile * tile, cut_[n_] = 0, tiles_[n_++].fill(inside ? 255 : 0);
    }
    void close() {
        if (n_ == 0) return;
        column_[n_] = last_;
        lay_out();
        sum_.add(sums(), at_, across_, uint64_t(to_ - from_));
    }
    // The checksum of all bands, of n bytes in all.
    uint32_t checksum(uint64_t n) const { return sum_.value(n); }

    // The rows, each after `before` zeros and before `after` ones.
    void write(uint32_t before, uint32_t after, Runs& runs) {
        Runs::End end = runs.reserve(size_t(to_ - from_) * size_t(2 * kTile * n_ + 8), size_t(to_ - from_) * across_);
        const int* column = column_.data();
        for (int row = from_; row < to_; ++row) {
            const uint8_t* bytes = levels(row);
            end.add(0, before);
            if (!(cut_rows_[row] >> (first_ & 7) & 1)) end.add(bytes[first_ & 7], 0);
            int begin = first_;
            const int* ends = ends_.data();
            for (const int* stop = find_turns(&cut_rows_[row], n_ / 8 + 1, ends_.data()); ends != stop; ends += 2) {
                const int from = ends[0], n = ends[1] - from;
                end.length += uint64_t(column[from >> 3] + (from & 7) - begin);
                if (n <= Runs::kAtOnce)
                    end.cut(bytes + from, n);
                else
                    end.mixed(bytes + from, n);
                begin = column[ends[1] >> 3] + (ends[1] & 7), end.value = bytes[ends[1]];
            }
            end.length += uint64_t(last_ - begin);
            end.add(0, after);
        }
        runs.set(end);
    }

 private:
    bool on(int tile) const { return kTile * tile > first_ - kTile && kTile * tile < last_; }
    // From row to row of the levels.
    ptrdiff_t stride() const { return kTile * capacity_; }
    const uint8_t* levels(int row) const { return &levels_[size_t(row * stride())]; }
    // Tiles as rows; zeros beyond the picture.
    void lay_out() {
        for (int i = n_; i < n_ + 8; ++i) cut_[i] = 0;
        orientation_(cut_.data(), n_ + 1, cut_rows_.data());
        orientation_(tiles_.data(), n_, levels_.data(), stride());
        const int before = std::max(first_ - column_[0], 0), after = std::max(column_[n_ - 1] + kTile - last_, 0);
        const int end = kTile * n_ - after;
        for (int row = 0; row < kTile; ++row) {
            cut_rows_[row] &= kAll << before, cut_rows_[end / 64 * 8 + row] &= ~(kAll << end % 64);
            uint8_t* first = &levels_[size_t(row * stride())];
            std::memset(first, 0, size_t(before)), std::memset(first + end, 0, size_t(after + 64));
        }
    }
    // Of the rows on the picture, the columns counted from the first one's.
    Sums sums() const {
        const uint64_t rows = uint64_t(to_ - from_);
        Sums between;  // the tiles, of one row
        for (int i = 0; i < n_; ++i) {
            const uint64_t value = levels(from_)[kTile * i + kTile - 1], begin = uint64_t(column_[i] + kTile);
            const uint64_t n = uint64_t(std::max(column_[i + 1] - column_[i] - kTile, 0));
            between.all += value * n, between.columns += value * (n * begin + n * (n - 1) / 2);
        }
        Sums sums{rows * between.all, rows * between.columns, rows * (rows + 1) / 2 * between.all};
        add_bytes(levels(from_), stride(), to_ - from_, column_.data(), n_, sums);
        sums.columns -= uint64_t(first_) * sums.all;
        return sums;
    }

    Orientation orientation_;
    int first_, last_, capacity_, n_ = 0;
    std::vector<int> column_;
    std::vector<Levels> tiles_;
    std::vector<uint64_t> cut_, cut_rows_;  // by tiles; by eights of these, and by their rows
    std::vector<uint8_t> levels_;
    std::vector<int> ends_;
    int from_ = 0, to_ = 0;
    uint64_t at_ = 0, across_ = 0;
    Adler sum_;
};

// --- The tiles of a layer as a picture meets them.

// Eight rows of pixels after eight rows, sorted by counting: first by columns, then by rows.
class TileRows {
 public:
    struct Spot {
        int32_t across, tile;
    };

    TileRows(const Slabs& slabs, const View& view, int down, int across) {
        if (slabs.size() == 1) {
            sort(*slabs[0], view, down, across);
            return;
        }
        std::vector<TileRows> each;
        for (const Slab* slab : slabs) each.emplace_back(Slabs{slab}, view, down, across);
        for (int row = 0; row < down; ++row) {
            begin_.push_back(int32_t(spots_.size()));
            for (const TileRows& rows : each) spots_.insert(spots_.end(), rows[row].first, rows[row].second);
            const auto own = spots_.begin() + begin_.back();
            std::ranges::sort(own, spots_.end(), {}, &Spot::across);
            spots_.erase(std::ranges::unique(own, spots_.end(), {}, &Spot::across).begin(), spots_.end());
        }
        begin_.push_back(int32_t(spots_.size()));
    }
    std::pair<const Spot*, const Spot*> operator[](int row) const {
        return {spots_.data() + begin_[row], spots_.data() + begin_[row + 1]};
    }

 private:
    void sort(const Slab& slab, const View& view, int down, int across) {
        const auto first = kTiles, last = int32_t(slab.tiles().count());
        spots_.resize(size_t(last - first));
        Rows<int32_t> by_column(spots_.size());
        auto row = [&](int32_t t) { return down - (view.transposed ? slab.tiles().place[t].x : slab.tiles().place[t].y); };
        auto column = [&](int32_t t) {
            const int at = view.transposed ? slab.tiles().place[t].y : slab.tiles().place[t].x;
            return view.backwards ? across - at : at - 1;
        };
        std::vector<int32_t> columns(across + 1), rows(down + 1);
        for (int32_t t = first; t < last; ++t) ++columns[column(t) + 1], ++rows[row(t) + 1];
        std::partial_sum(columns.begin(), columns.end(), columns.begin());
        std::partial_sum(rows.begin(), rows.end(), rows.begin());
        begin_ = rows;
        for (int32_t t = first; t < last; ++t) by_column[columns[column(t)]++] = t;
        for (int32_t t : by_column) spots_[rows[row(t)]++] = {column(t), t};
    }

    Rows<Spot> spots_;
    std::vector<int32_t> begin_;  // of each row of tiles
};

namespace {

// A tile of which some cells are cut, and where their levels go.
struct Cut {
    size_t slab;
    Quad tiles;
    Corners corners;
    Levels* levels;
    bool over;  // another slab's levels, of which the greater ones stay
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
    Shown(const Slabs& slabs, const View& view, Encoding encoding)
        : slabs_(slabs), view_(view), encoding_(encoding), filter_(encoding == Encoding::png),
          down_(side(view.transposed), view.shape[view.transposed], view.at[view.transposed], view.rows, true),
          across_(side(!view.transposed), view.shape[!view.transposed], view.at[!view.transposed], view.columns, view.backwards),
          band_(Orientation(view.transposed, view.backwards, view.levels), across_.tiles, across_.first, across_.last),
          rows_(slabs, view, down_.tiles, across_.tiles) {
        for (const Slab* slab : slabs) coverage_.emplace_back(*slab);
    }

    Picture picture() {
        read_all();
        if (encoding_ != Encoding::png) return {&run_lengths(runs_, encoding_), painted_};
        return {&runs_.zlib(band_.checksum((uint64_t(view_.columns) + filter_) * uint64_t(view_.rows))), painted_};
    }

    // The runs of all rows.
    Runs& read_all() {
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
        for (const Coverage& one : coverage_) painted_.area += one.area();
        return runs_;
    }
    Painted painted() const { return painted_; }

 private:
    int side(bool along_x) const { return along_x ? slabs_[0]->columns() : slabs_[0]->rows(); }
    bool is_full(size_t place) const {
        return std::ranges::any_of(slabs_, [&](const Slab* slab) { return slab->spot(0, 0)[place] == kFull; });
    }
    // Whether the first sample of a place without cut cells is inside.
    bool is_inside(size_t place) const {
        return std::ranges::any_of(slabs_, [&](const Slab* slab) { return slab->tiles().inside[slab->spot(0, 0)[place]] & 1; });
    }
    bool is_tile(size_t place) const {
        return std::ranges::any_of(slabs_, [&](const Slab* slab) { return slab->spot(0, 0)[place] >= kTiles; });
    }

    // Reads the tiles of eight rows; false if they are empty.
    bool read(int tile) {
        using Spot = TileRows::Spot;
        const auto [begin, end] = rows_[tile];
        if (begin == end) return false;
        const int n = across_.tiles, along = down_.tiles - tile, beside = view_.backwards ? n : 1;
        const ptrdiff_t columns = slabs_[0]->columns();
        const ptrdiff_t first = view_.transposed ? beside * columns + along : along * columns + beside;
        const ptrdiff_t step = (view_.transposed ? columns : 1) * (view_.backwards ? -1 : 1);
        auto place = [&](int i) { return size_t(first + step * i); };
        // All between two tiles is as the one after the first is; the same is before the first tile and after the last.
        int next = across_.first / kTile;  // tile that the band may lack
        auto put_next = [&](int i) {
            if (i == next && i < n) band_.uniform(i, is_inside(place(i))), ++next;
        };
        if (next < n && !is_tile(place(next))) put_next(next);
        cut_.clear();
        for (const Spot* spot = begin; spot != end; ++spot) {
            const int i = spot->across, after = spot + 1 == end ? n : spot[1].across;
            if (put(i, place(i))) next = std::max(next, i + 1);
            put_next(i);
            if (i + 1 == after) continue;
            put_next(i + 1);
            if (is_full(place(i + 1))) painted_.area += kTile * kTile * double(after - i - 1);
        }
        for (const Cut& cut : cut_) cover(cut);
        band_.close();
        return true;
    }

    // Whether the tile is cut.
    bool put(int i, size_t place) {
        seen_.clear();
        uint64_t whole = 0;
        for (const Slab* slab : slabs_) {
            const int32_t* spot = slab->spot(0, 0) + place;
            const Quad tiles(spot, slab->columns());
            const Corners corners(*slab, tiles);
            const uint64_t cut = *spot < kTiles ? 0 : corners.mixed() | slab->tiles().sharp[tiles.own];
            seen_.push_back({tiles, corners, cut});
            whole |= corners.whole() & ~cut;
        }
        uint64_t cut = 0;
        for (const Seen& one : seen_) cut |= one.cut & ~whole;
        if (!cut) {
            painted_.area += std::popcount(whole);
            return false;
        }
        painted_.partly += std::popcount(cut);
        Levels& levels = band_.cut(i, cut);
        bool over = false;
        for (size_t s = 0; s < slabs_.size(); ++s) {
            const auto& [tiles, corners, own] = seen_[s];
            if (tiles.own == kEmpty || (!own && !corners.whole())) continue;
            const float* values = slabs_[s]->tiles().values[tiles.own].data();
            for (int k = 0; k < 64; k += 16) prefetch(values + k);
            cut_.push_back({s, tiles, corners, &levels, over});
            over = true;
        }
        return true;
    }

    void cover(const Cut& cut) {
        if (!cut.over) return coverage_[cut.slab](cut.tiles, cut.corners, *cut.levels);
        Levels more;
        coverage_[cut.slab](cut.tiles, cut.corners, more);
        int shared = 0;
        for (size_t k = 0; k < more.size(); ++k) {
            uint8_t& level = (*cut.levels)[k];
            shared += std::min(level, more[k]), level = std::max(level, more[k]);
        }
        painted_.area -= shared / 255.0;
    }

    // What a slab has in a place: its tiles there, and the cells that it cuts.
    struct Seen {
        Quad tiles;
        Corners corners;
        uint64_t cut;
    };

    Slabs slabs_;
    const View& view_;
    Encoding encoding_;
    uint32_t filter_;  // bytes before each row
    Axis down_, across_;
    Band band_;
    std::vector<Coverage> coverage_;
    std::vector<Seen> seen_;
    Rows<Cut> cut_;
    TileRows rows_;
    Runs& runs_ = runs_of_thread;
    Painted painted_{0, 0};
};

// Pixels of one level, not 0, in a row of a picture.
struct Streak {
    int32_t column, count;
    uint8_t level;
};

// The streaks of each row of an object.
class StreakRows {
 public:
    StreakRows(Runs& runs, int rows, int columns) : begin_(size_t(rows) + 1) {
        int row = 0, column = 0;
        runs.each([&](uint8_t level, uint64_t n) {
            while (n > 0) {
                const int count = int(std::min(n, uint64_t(columns - column)));
                if (level) streaks_.push_back({column, count, level});
                column += count, n -= uint64_t(count);
                if (column == columns) column = 0, begin_[size_t(++row)] = streaks_.size();
            }
        });
    }
    std::pair<const Streak*, const Streak*> operator[](int row) const {
        return {streaks_.data() + begin_[size_t(row)], streaks_.data() + begin_[size_t(row) + 1]};
    }

 private:
    std::vector<Streak> streaks_;
    std::vector<size_t> begin_;  // of each row
};

// Puts a streak after others that begin before it, of which it may cover the last one: where both are, the higher level is shown.
// Returns the area that both cover, by their levels.
double put_over(Streak next, std::vector<Streak>& line) {
    double shared = 0;
    if (!line.empty() && next.column < line.back().column + line.back().count) {
        const Streak last = line.back();
        const int first = std::max(next.column, last.column), end = last.column + last.count, stop = next.column + next.count;
        const int both = std::min(end, stop) - first;
        line.back().count = first - last.column;
        if (line.back().count == 0) line.pop_back();
        if (both > 0) line.push_back({first, both, std::max(next.level, last.level)});
        shared = both * std::min(next.level, last.level) / 255.0;
        if (end > first + both) line.push_back({first + both, end - first - both, last.level});
        next = {first + both, stop - first - both, next.level};
    }
    if (next.count > 0) line.push_back(next);
    return shared;
}

}  // namespace

Picture picture(const Slabs& slabs, const View& view, Encoding encoding) { return Shown(slabs, view, encoding).picture(); }

Picture picture(const std::vector<Piece>& pieces, int rows, int columns, Encoding encoding) {
    struct Shows {
        const StreakRows* streaks;
        int row, rows, column;
        bool upside_down;
    };
    Painted painted{0, 0};
    std::vector<StreakRows> streaks;
    std::vector<Shows> shows;
    streaks.reserve(pieces.size());
    for (const Piece& piece : pieces) {
        Shown alone(piece.slabs, piece.view, Encoding::goo);
        streaks.emplace_back(alone.read_all(), piece.view.rows, piece.view.columns);
        for (const auto& [row, column] : piece.places) {
            painted.area += alone.painted().area, painted.partly += alone.painted().partly;
            shows.push_back({&streaks.back(), row, piece.view.rows, column, piece.upside_down});
        }
    }
    std::ranges::sort(shows, {}, &Shows::column);
    Runs& runs = runs_of_thread;
    runs.clear();
    Adler sum;
    const int filter = encoding == Encoding::png;
    const int64_t stride = columns + filter;
    std::vector<Streak> given, line;
    for (int y = 0; y < rows; ++y) {
        given.clear(), line.clear();
        for (const Shows& one : shows) {
            const int own = y - one.row;
            if (own < 0 || own >= one.rows) continue;
            const auto [begin, end] = (*one.streaks)[one.upside_down ? one.rows - 1 - own : own];
            for (const Streak* s = begin; s != end; ++s) given.push_back({s->column + one.column, s->count, s->level});
        }
        if (shows.size() > 1) std::ranges::stable_sort(given, {}, &Streak::column);
        for (const Streak& s : given) painted.area -= put_over(s, line);
        int at = 0;
        runs.add(0, uint64_t(filter));
        for (const Streak& s : line) {
            const int first = std::max(s.column, at), last = std::min(s.column + s.count, columns);
            if (first >= last) continue;
            runs.add(0, uint64_t(first - at)), runs.add(s.level, uint64_t(last - first));
            sum.add(s.level, uint64_t(y * stride + filter + first), uint64_t(last - first));
            at = last;
        }
        runs.add(0, uint64_t(columns - at));
    }
    if (encoding != Encoding::png) return {&run_lengths(runs, encoding), painted};
    return {&runs.zlib(sum.value(uint64_t(stride) * uint64_t(rows))), painted};
}

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
