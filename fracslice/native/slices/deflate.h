// Runs of equal bytes, deflated without ever being laid out.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "avx512.h"
#include "slab.h"

namespace fracslice::slices {

constexpr int kShortest = 3, kLongest = 258;  // bytes that a match repeats

// A symbol of `Runs`: a byte, repeated; then matches of one length.
struct Meaning {
    uint8_t byte, bytes, matches;
    uint16_t length;
};

// A string of bytes, given run by run; `zlib` writes it as RFC 1950 and 1951 have it, in one block with codes of its own.
// Matches repeat the byte before them, no other is looked for. Its memory can be used again.
class Runs {
 public:
    static constexpr int kAtOnce = 8;  // bytes

    // Symbols: bytes; a zero or a 255 and how many times it comes again, less than a longest match; a match of any byte; and so
    // many longest ones, at most three.
    static constexpr int kPlain = 256, kMatch = kPlain + 2 * kLongest, kMore = kMatch + kLongest, kNothing = kMore + 4,
                         kSymbols = kNothing + 1;

    // Where the next symbol goes, and the run so far.
    struct End {
        uint16_t* symbol;
        uint64_t length;
        uint8_t value;

        // A run, or more of the last one.
        void add(uint8_t next, uint64_t n) {
            if (next != value) {
                close();
                value = next;
            }
            length += n;
        }
        // Ends the run of zeros or 255s so far, which is not empty, with n bytes, at most `kAtOnce`; twice as many may be read.
        void cut(const uint8_t* from, int n) {
            using Bytes = uint8_t __attribute__((vector_size(2 * kAtOnce)));
            plain();
            Bytes bytes;
            std::memcpy(&bytes, from, sizeof bytes);
            bytes = __builtin_shufflevector(bytes, Bytes{}, 0, 16, 1, 16, 2, 16, 3, 16, 4, 16, 5, 16, 6, 16, 7, 16);
            std::memcpy(symbol, &bytes, sizeof bytes);
            symbol += n;
        }
        // Ends any run.
        void close() {
            if (length == 0) return;
            if (value == 0 || value == 255)
                plain();
            else
                *this = other(*this);
        }
        // Bytes among which there may be runs.
        void mixed(const uint8_t* from, int n) { *this = mixed(*this, from, n); }

     private:
        // By value, for what has an address is in no register.
        static End other(End end);
        static End mixed(End end, const uint8_t* from, int n);

        void plain() {
            uint64_t rest = length - 1, longest = 0;
            if (rest >= kLongest) longest = rest / kLongest, rest %= kLongest;
            *symbol++ = uint16_t(kPlain + (kLongest & int8_t(value)) + int(rest));
            more(longest);
            length = 0;
        }
        void more(uint64_t longest) {
            for (; longest > 3; longest -= 3) *symbol++ = kMore + 3;
            if (longest) *symbol++ = uint16_t(kMore + longest);
        }
    };

    // Begins.
    void clear() { end_ = {symbols_.data(), 0, 0}; }
    void add(uint8_t value, uint64_t n);
    // The end, with memory for more symbols and for longest matches of n bytes; `set` takes it back, advanced.
    End reserve(size_t symbols, uint64_t n);
    void set(const End& end) {
        assert(end.symbol <= symbols_.data() + symbols_.size());
        end_ = end;
    }
    // Ends; checksum: of all bytes. The result stays until another is asked for.
    const Rows<uint8_t>& zlib(uint32_t checksum);
    // Ends; visit(value, n): each run, which may go on in the next one.
    template <class Visit>
    void each(const Visit& visit) {
        const uint16_t* end = finish();
        uint8_t value = 0;
        for (const uint16_t* s = symbols_.data(); s != end; ++s) {
            const Meaning& meaning = meanings()[*s];
            if (meaning.bytes) value = meaning.byte;
            if (const uint64_t n = meaning.bytes + uint64_t(meaning.matches) * meaning.length) visit(value, n);
        }
    }

 private:
    // Ends the last run; the end of the symbols, whose number is a multiple of 4.
    const uint16_t* finish();
    static const Meaning* meanings();

    Rows<uint16_t> symbols_;
    Rows<uint8_t> data_;
    End end_;
};

// --- Filters of PNG rows (ISO/IEC 15948, clause 9).

// Rows of bytes after the first one, which is that above them, each behind the number of the filter whose bytes have the
// smallest sum of absolute values, as signed numbers; `pixel` is the number of bytes of a pixel.
void filter_rows(const uint8_t* rows, size_t count, size_t width, size_t pixel, uint8_t* out);

// --- Run lengths of pictures, as resin printers read them.

// Encodings of a picture: rows of a PNG file, each after a byte 0, as a zlib stream; or its levels in one string from row to row.
enum class Encoding {
    png,
    goo,   // .goo V3.0: runs and differences of 8 bits, between a mark and a checksum
    rle7,  // .ctb: 7 bits, lengths of one to four bytes
    rle4,  // .pwmx: 4 bits, lengths of 4 bits, or of 12 where a level is the lowest or highest
    rle1,  // .cbddlp: one bit, lengths of 7 bits
};

// The bytes of an encoding other than `png`, until this thread encodes another.
const Rows<uint8_t>& run_lengths(Runs& runs, Encoding encoding);

// --- The checksum of a zlib stream (RFC 1950) from parts in any order.

// Of the bytes of rows: the sum of all, of each times its column, and of each times how many rows there are from its own on.
struct Sums {
    uint64_t all = 0, columns = 0, rows = 0;
};

// Adds `tiles` times eight bytes of each row, the n rows `stride` apart. column: of the first of the eight, not negative.
inline void add_each(const uint8_t* bytes, ptrdiff_t stride, int n, const int* column, int tiles, Sums& sums) {
    // Numbers of 16 bits that are multiplied by others and added are the last one of the product.
    constexpr uint64_t even = 0x00FF00FF00FF00FF, ones = 0x0001000100010001, places[] = {0x0000000200040006, 0x0001000300050007};
    for (int row = 0; row < n; ++row)
        for (int tile = 0; tile < tiles; ++tile) {
            uint64_t word;
            std::memcpy(&word, bytes + row * stride + 8 * tile, sizeof word);
            const uint64_t a = word & even, b = word >> 8 & even, sum = (a + b) * ones >> 48;
            sums.all += sum, sums.rows += sum * uint64_t(n - row);
            sums.columns += sum * uint64_t(column[tile]) + ((a * places[0] + b * places[1]) >> 48);
        }
}
#if defined(FRACSLICE_WIDE)
// Eight tiles at a time; behind the last one bytes are zeros.
FRACSLICE_WIDE inline void add_wide(const uint8_t* bytes, ptrdiff_t stride, int n, const int* column, int tiles, Sums& sums) {
    const __m512i places = _mm512_set1_epi64(0x0706050403020100), none = _mm512_setzero_si512();
    __m512i all = none, columns = none, rows = none;
    for (int tile = 0; tile < tiles; tile += 8) {
        __m512i sum = none, inner = none;  // by tiles; of bytes times their places in a tile, as numbers of 16 bits
        for (int row = 0; row < n; ++row) {
            const __m512i some = _mm512_loadu_si512(bytes + row * stride + 8 * tile);
            sum = _mm512_add_epi64(sum, _mm512_sad_epu8(some, none));
            rows = _mm512_add_epi64(rows, sum);
            inner = _mm512_add_epi16(inner, _mm512_maddubs_epi16(some, places));
        }
        const __m256i eight = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(column + tile));
        all = _mm512_add_epi64(all, sum);
        columns = _mm512_add_epi64(columns, _mm512_maskz_mul_epu32(0xFF, sum, _mm512_maskz_cvtepu32_epi64(0xFF, eight)));
        inner = _mm512_madd_epi16(inner, _mm512_set1_epi16(1));
        columns = _mm512_add_epi64(columns, _mm512_maskz_srli_epi64(0xFF, inner, 32));
        columns = _mm512_add_epi64(columns, _mm512_maskz_and_epi64(0xFF, inner, _mm512_set1_epi64(0xFFFFFFFF)));
    }
    uint64_t part[3][8];
    _mm512_storeu_si512(part[0], all), _mm512_storeu_si512(part[1], columns), _mm512_storeu_si512(part[2], rows);
    for (int i = 0; i < 8; ++i) sums.all += part[0][i], sums.columns += part[1][i], sums.rows += part[2][i];
}
inline const auto add_bytes = kWide ? add_wide : add_each;
#else
inline constexpr auto add_bytes = add_each;
#endif

// With d_i the n bytes: 1 + sum d_i, and n + sum (n - i) d_i, modulo 65521.
class Adler {
 public:
    // n equal bytes from place `at` on.
    void add(uint64_t value, uint64_t at, uint64_t n) {
        sum_ += value * n;
        weighted_ += value * ((n % kModulus * (at % kModulus) + n * (n - 1) / 2) % kModulus);
    }
    // n rows of which column 0 is at place `at` and `stride` further from row to row.
    void add(const Sums& sums, uint64_t at, uint64_t stride, uint64_t n) {
        sum_ += sums.all;
        weighted_ += (sums.all % kModulus * (at % kModulus) + stride * (n * sums.all - sums.rows) + sums.columns) % kModulus;
    }
    // Of n bytes in all.
    uint32_t value(uint64_t n) const {
        const uint64_t sum = sum_ % kModulus, weighted = weighted_ % kModulus;
        n %= kModulus;
        return uint32_t((n + n * sum + kModulus - weighted) % kModulus << 16 | (1 + sum) % kModulus);
    }

 private:
    static constexpr uint64_t kModulus = 65521;

    uint64_t sum_ = 0, weighted_ = 0;
};

}  // namespace fracslice::slices
