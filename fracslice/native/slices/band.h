// Eight rows of a picture on their way to a string of bytes.
#pragma once
#include <algorithm>
#include <cstring>
#include <vector>

#include "adler.h"
#include "coverage.h"
#include "deflate.h"
#include "wide.h"

namespace fracslice {

// The numbers of bits that differ from the one before, of n bytes; returns the end. Up to 7 bytes after them are read, as zeros
// or as they are, and up to `kSlack` numbers behind the end are written.
inline int* turns_each(const uint8_t* bytes, int n, int* end) {
    uint64_t before = 0;
    for (int i = 0; i < n; i += 8) {
        uint64_t word;
        std::memcpy(&word, bytes + i, 8);
        each(word ^ (word << 1 | before), [&](int bit) { *end++ = kTile * i + bit; });
        before = word >> 63;
    }
    return end;
}
#if defined(FRACSLICE_WIDE)
FRACSLICE_WIDE inline int* turns_wide(const uint8_t* bytes, int n, int* end) {
    alignas(64) uint8_t ramp[64], bits[64];
    for (int bit = 0; bit < 64; ++bit) ramp[bit] = uint8_t(bit);
    const __m512i all = _mm512_load_si512(ramp);
    uint64_t before = 0;
    for (int i = 0; i < n; i += 8) {
        uint64_t word;
        std::memcpy(&word, bytes + i, 8);
        const uint64_t turns = word ^ (word << 1 | before);
        before = word >> 63;
        _mm512_store_si512(bits, _mm512_maskz_compress_epi8(turns, all));
        const int count = int(_mm_popcnt_u64(turns));
        for (int at = 0; at < count; at += 16) {
            const __m512i some = _mm512_maskz_cvtepu8_epi32(0xFFFF, _mm_load_si128(reinterpret_cast<const __m128i*>(bits + at)));
            _mm512_storeu_si512(end + at, _mm512_add_epi32(some, _mm512_set1_epi32(kTile * i)));
        }
        end += count;
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
    Band(int tiles, int first, int last)
        : first_(first), last_(last), room_(tiles / 8 * 8 + 16), column_(room_), whole_(room_), cut_(kTile * room_),
          levels_(kTile * stride() + Runs::kAtOnce), full_(room_),
          ends_(kTile * room_ + 2 + kSlack) {}

    // Begins with eight rows of which those from `from` to before `to` are on the picture; `at`: the place of the first one's
    // first byte among all bytes, `stride` from row to row.
    void clear(int from, int to, int64_t at, uint64_t stride) {
        n_ = 0, from_ = from, to_ = to, at_ = at, across_ = stride, eight_ = {};
    }
    // The tile as the next one, if it is on the picture.
    void put(int tile, uint64_t whole, uint64_t cut, const Levels& levels) {
        const int column = kTile * tile;
        if (column <= first_ - kTile || column >= last_) return;
        if (column < first_) cut &= kAll / 255 * (0xFF & 0xFF << (first_ - column));
        if (column > last_ - kTile) cut &= kAll / 255 * (0xFF >> (column + kTile - last_));
        add(column, levels);
        const ptrdiff_t room = room_;  // as bytes may be anything
        uint8_t *rows = &cut_[n_], *to = &levels_[kTile * n_];
        for (int row = 0; row < kTile; ++row) {
            rows[row * room] = uint8_t(cut >> kTile * row);
            std::memcpy(to + kTile * row * room, &levels[kTile * row], kTile);
        }
        column_[n_] = column, full_[n_] = false, whole_[n_++] = whole;
    }
    // One that is not cut.
    void put(int tile, bool inside) {
        if (kTile * tile <= first_ - kTile || kTile * tile >= last_) return;
        for (int row = 0; row < kTile; ++row) cut_[n_ + row * room_] = 0;
        column_[n_] = kTile * tile, full_[n_] = inside, whole_[n_++] = inside ? kAll : 0;
    }
    void close() {
        column_[n_] = last_;
        for (int row = 0; row < kTile; ++row) std::memset(&cut_[row * room_ + n_], 0, kTile);
        for (int i = 0; i < n_; ++i) {
            if (!full_[i]) continue;
            const int begin = std::max(column_[i], first_);
            eight_.add(255, from_, to_, place(begin), uint64_t(column_[i + 1] - begin));
        }
        sum_.add(eight_, at_ - int64_t(place(first_)) - from_ * int64_t(across_), across_);
    }
    // The checksum of all bands, of n bytes in all.
    uint32_t checksum(uint64_t n) const { return sum_.value(n); }

    // The rows, each after `before` zeros and before `after` ones.
    void write(uint32_t before, uint32_t after, Runs& runs) {
        Runs::End end = runs.room(size_t(to_ - from_) * size_t(2 * kTile * n_ + 8), size_t(to_ - from_) * across_);
        const int* column = column_.data();
        const uint64_t* whole = whole_.data();
        for (int row = from_; row < to_; ++row) {
            const uint8_t* levels = &levels_[size_t(row * stride())];
            auto filled = [&](int at) { return uint8_t(-(whole[at >> 3] >> (kTile * row + (at & 7)) & 1)); };
            end.add(0, before);
            end.add(filled(first_ & 7), 0);
            int begin = first_;
            const int* ends = ends_.data();
            for (const int* stop = turns(row); ends != stop; ends += 2) {
                const int from = ends[0], n = ends[1] - from;
                const uint8_t* bytes = levels + from;
                end.length += uint64_t(column[from >> 3] + (from & 7) - begin);
                if (n <= Runs::kAtOnce)
                    end.cut(bytes, n);
                else
                    end.mixed(bytes, n);
                begin = column[ends[1] >> 3] + (ends[1] & 7), end.value = filled(ends[1]);
            }
            end.length += uint64_t(last_ - begin);
            end.add(0, after);
        }
        runs.set(end);
    }

 private:
    // Of a column among the sums of eight rows: not negative.
    uint32_t place(int column) const { return uint32_t(column - first_ + kTile); }
    // A tile to the sum of all bytes.
    void add(int column, const Levels& levels) {
        if (from_ == 0 && to_ == kTile && column >= first_ && column <= last_ - kTile) return eight_.add(levels, place(column));
        Levels shown{};
        for (int row = from_; row < to_; ++row)
            for (int x = std::max(first_ - column, 0); x < std::min(last_ - column, kTile); ++x)
                shown[size_t(kTile * row + x)] = levels[size_t(kTile * row + x)];
        eight_.add(shown, place(column));
    }
    // From row to row of the levels.
    int stride() const { return kTile * room_; }
    // Where in a row pixels begin to be cut, and where they end to be, by turns; returns the end.
    const int* turns(int row) {
        const uint8_t* cut = &cut_[row * room_];
        return find_turns(cut, n_ + 1, ends_.data());
    }

    int first_, last_, room_, n_ = 0;
    std::vector<int> column_;
    std::vector<uint64_t> whole_;
    std::vector<uint8_t> cut_, levels_, full_;
    std::vector<int> ends_;
    int from_ = 0, to_ = 0;
    int64_t at_ = 0;
    uint64_t across_ = 0;
    Eight eight_;
    Adler sum_;
};

}  // namespace fracslice
