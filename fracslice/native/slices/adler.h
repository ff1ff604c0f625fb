// The checksum of a zlib stream (RFC 1950) from parts in any order.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "avx512.h"

namespace fracslice::slices {

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
