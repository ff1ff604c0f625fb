// Eight rows of a picture on their way to a string of bytes.
#pragma once
#include <algorithm>
#include <cstring>
#include <vector>

#include "adler.h"
#include "coverage.h"
#include "deflate.h"
#include "orientation.h"
#include "avx512.h"

namespace fracslice::slices {

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

}  // namespace fracslice::slices
