#include "picture.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "deflate.h"
#include "pixels.h"

namespace fracslice {
namespace {

// A word of signs as a screen shows it: its rows are rows of the picture, from above.
class Turn {
 public:
    explicit Turn(const View& view) : transposed_(view.transposed), reversed_(view.backwards) {
        for (int bit = 0; bit < 64; ++bit) {
            int down = kTile - 1 - (bit >> 3), across = reversed_ ? kTile - 1 - (bit & 7) : bit & 7;
            from_[bit] = uint8_t(transposed_ ? kTile * across + down : kTile * down + across);
        }
    }
    uint64_t operator()(uint64_t word) const {
        if (transposed_) word = transposed(word);
        word = __builtin_bswap64(word);
        return reversed_ ? mirrored(word) : word;
    }
    // The sample that comes to a place of the word.
    int from(int bit) const { return from_[bit]; }

 private:
    bool transposed_, reversed_;
    std::array<uint8_t, 64> from_;
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

// Eight rows of a picture between the first and the last tile: which pixels are wholly inside, which are cut, and how much.
class Band {
 public:
    explicit Band(int tiles)
        : stride_(tiles / 8 * 8 + 8), whole_(kTile * stride_), cut_(kTile * stride_), levels_(64 * (tiles + 1)) {}

    void clear() {
        std::fill(whole_.begin(), whole_.end(), 0), std::fill(cut_.begin(), cut_.end(), 0);
        for (int row = 0; row < kTile; ++row) end_[row] = &levels_[row * (levels_.size() / kTile)];
    }
    void fill(int tile, int n) {
        for (int row = 0; row < kTile; ++row) std::memset(&whole_[row * stride_ + tile], 255, size_t(n));
    }
    void put(int tile, uint64_t whole, uint64_t cut) {
        for (int row = 0; row < kTile; ++row) {
            whole_[row * stride_ + tile] = uint8_t(whole >> kTile * row);
            cut_[row * stride_ + tile] = uint8_t(cut >> kTile * row);
        }
    }
    // The levels of cut pixels of the next tile.
    void push(uint64_t cut, const uint8_t* levels) {
        for (int row = 0; row < kTile; ++row) {
            const int n = __builtin_popcountll(cut >> kTile * row & 0xFF);
            std::memcpy(end_[row], levels, kTile);
            end_[row] += n, levels += n;
        }
    }

    void write(int row, int first, int last, Runs& runs) const {
        const uint8_t* level = &levels_[row * (levels_.size() / kTile)];
        uint64_t whole_before = 0, cut_before = 0;
        uint8_t value = 0;
        int begin = first;  // of the run of this value
        for (int at = 0; at < last; at += 64) {
            uint64_t whole = word(whole_, row, at), cut = word(cut_, row, at);
            uint64_t changes = cut | (cut << 1 | cut_before) | (whole ^ (whole << 1 | whole_before));
            whole_before = whole >> 63, cut_before = cut >> 63;
            if (at < first) {
                uint64_t beside = first - at < 64 ? (uint64_t(1) << (first - at)) - 1 : kAll;
                level += __builtin_popcountll(cut & beside);
                changes = (changes | (beside + 1)) & ~beside;
            }
            if (last - at < 64) changes &= (uint64_t(1) << (last - at)) - 1;
            each(changes, [&](int bit) {
                runs.add(value, uint64_t(at + bit - begin));
                begin = at + bit;
                const bool is_cut = cut >> bit & 1;
                const uint8_t filled = uint8_t(-(whole >> bit & 1));
                value = is_cut ? *level : filled;
                level += is_cut;
            });
        }
        runs.add(value, uint64_t(last - begin));
    }

 private:
    uint64_t word(const std::vector<uint8_t>& bits, int row, int at) const {
        uint64_t word;
        std::memcpy(&word, &bits[row * stride_ + at / 8], 8);
        return word;
    }

    size_t stride_;
    std::vector<uint8_t> whole_, cut_, levels_;
    std::array<uint8_t*, kTile> end_;
};

// A layer on its way to a picture.
class Shown {
 public:
    Shown(const Slab& slab, int layer, const View& view)
        : slab_(slab), layer_(layer), view_(view), turn_(view),
          down_(side(view.transposed), view.shape[view.transposed], view.at[view.transposed], view.rows, true),
          across_(side(!view.transposed), view.shape[!view.transposed], view.at[!view.transposed], view.columns, view.backwards),
          band_(across_.tiles) {}

    Picture picture() {
        const uint64_t row = uint64_t(view_.columns) + 1;
        runs_.add(0, row * down_.at);
        for (int tile = down_.first / kTile; tile * kTile < down_.last; ++tile) {
            int from = std::max(down_.first - tile * kTile, 0), to = std::min(down_.last - tile * kTile, kTile);
            if (!read(tile)) {
                runs_.add(0, row * (to - from));
                continue;
            }
            for (int r = from; r < to; ++r) {
                runs_.add(0, uint64_t(across_.at) + 1);
                band_.write(r, across_.first, across_.last, runs_);
                runs_.add(0, uint64_t(view_.columns - across_.at - across_.count()));
            }
        }
        runs_.add(0, row * (view_.rows - down_.at - down_.count()));
        return {runs_.zlib(), painted_};
    }

 private:
    int side(bool along_x) const { return along_x ? slab_.columns() : slab_.rows(); }

    // Reads the tiles of eight rows; false if they are empty.
    bool read(int tile) {
        const int along = down_.tiles - tile, step = view_.backwards ? -1 : 1;
        auto place = [&](int i) {
            const int beside = view_.backwards ? across_.tiles - i : i + 1;
            return view_.transposed ? Place{layer_, beside, along} : Place{layer_, along, beside};
        };
        const Place p = place(0);
        const int32_t* at = slab_.spot(p.layer, p.y, p.x);
        const ptrdiff_t next = step * (view_.transposed ? slab_.columns() : 1);
        const int n = across_.tiles;
        bool any = false;
        band_.clear();
        for (int i = 0; i < n;) {
            const int32_t t = at[next * i];
            int end = i + 1;
            if (t >= kTiles)
                read(place(i), t, i);
            else
                while (end < n && at[next * end] == t) ++end;
            if (t == kFull) band_.fill(i, end - i), painted_.area += kTile * kTile * (end - i);
            any |= t != kEmpty;
            i = end;
        }
        return any;
    }

    void read(const Place& p, int32_t t, int i) {
        const Corners corners(slab_, p.layer, p.y, p.x);
        const uint64_t sharp = slab_.sharp[t], whole = corners.whole() & ~sharp, cut = turn_(corners.mixed() | sharp);
        band_.put(i, turn_(whole), cut);
        const Cells cells(slab_, p);
        float areas[64];
        uint8_t levels[64 + kTile];
        int n = 0;
        each(cut, [&](int bit) { areas[n++] = cells.area(turn_.from(bit), corners.signs(turn_.from(bit))); });
        if (sharp) sharpen(t, cut, areas);
        float inside = float(__builtin_popcountll(whole));
        for (int i = 0; i < n; ++i) inside += areas[i], levels[i] = view_.levels[uint8_t(255 * areas[i] + 0.5f)];
        band_.push(cut, levels);
        painted_.area += inside;
        painted_.partly += n;
    }

    void sharpen(int32_t t, uint64_t cut, float* area) const {
        each(cut, [&](int bit) {
            *area = slab_.sharpened(t, turn_.from(bit), *area);
            ++area;
        });
    }

    const Slab& slab_;
    int layer_;
    const View& view_;
    Turn turn_;
    Axis down_, across_;
    Band band_;
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
