// The checksum of a zlib stream (RFC 1950) from parts in any order.
#pragma once
#include <array>
#include <cstdint>

#include "wide.h"

namespace fracslice {

// Sums of eight rows of bytes.
class Eight {
 public:
    // Eight bytes of each row, from a column on.
    void add(const std::array<uint8_t, 64>& bytes, uint32_t column) { add_tile(bytes.data(), column, *this); }
    // n equal bytes of the rows from `from` to before `to`.
    void add(uint64_t value, int from, int to, uint64_t column, uint64_t n) {
        for (int row = from; row < to; ++row) rows[row] += value * n;
        weighted[0] += uint64_t(to - from) * value * (n * column + n * (n - 1) / 2);
    }

    std::array<uint64_t, 8> rows{}, weighted{};  // of the bytes of each row; of all bytes times their columns, in parts

 private:
    static void add_each(const uint8_t* bytes, uint32_t column, Eight& sums) {
        for (int row = 0; row < 8; ++row)
            for (uint32_t i = 0; i < 8; ++i) {
                const uint64_t byte = bytes[8 * row + i];
                sums.rows[row] += byte, sums.weighted[row] += byte * (column + i);
            }
    }
#if defined(FRACSLICE_WIDE)
    FRACSLICE_WIDE static void add_wide(const uint8_t* bytes, uint32_t column, Eight& sums) {
        const __m512i all = _mm512_loadu_si512(bytes), places = _mm512_set1_epi64(0x0706050403020100);
        const __m512i rows = _mm512_sad_epu8(all, _mm512_setzero_si512());
        // A row's bytes times their places are two numbers of 32 bits.
        const __m512i inner = _mm512_madd_epi16(_mm512_maddubs_epi16(all, places), _mm512_set1_epi16(1));
        __m512i weighted = _mm512_maskz_mul_epu32(0xFF, rows, _mm512_set1_epi64(column));
        weighted = _mm512_add_epi64(weighted, _mm512_maskz_srli_epi64(0xFF, inner, 32));
        weighted = _mm512_add_epi64(weighted, _mm512_maskz_and_epi64(0xFF, inner, _mm512_set1_epi64(0xFFFFFFFF)));
        _mm512_storeu_si512(sums.rows.data(), _mm512_add_epi64(_mm512_loadu_si512(sums.rows.data()), rows));
        _mm512_storeu_si512(sums.weighted.data(), _mm512_add_epi64(_mm512_loadu_si512(sums.weighted.data()), weighted));
    }
    inline static const auto add_tile = kWide ? add_wide : add_each;
#else
    static constexpr auto add_tile = add_each;
#endif
};

// With d_i the n bytes: 1 + sum d_i, and n + sum (n - i) d_i, modulo 65521.
class Adler {
 public:
    // n equal bytes from place `at` on.
    void add(uint64_t value, uint64_t at, uint64_t n) {
        sum_ += value * n;
        weighted_ += value * ((n % kModulus * (at % kModulus) + n * (n - 1) / 2) % kModulus);
    }
    // Rows of which column 0 is at place `at`, which may be before the first, and `stride` further from row to row.
    void add(const Eight& sums, int64_t at, uint64_t stride) {
        for (uint64_t row = 0; row < 8; ++row) {
            sum_ += sums.rows[row];
            weighted_ += sums.rows[row] % kModulus * modulo(at + int64_t(row * stride)) + sums.weighted[row] % kModulus;
        }
    }
    // Of n bytes in all.
    uint32_t value(uint64_t n) const {
        const uint64_t sum = sum_ % kModulus, weighted = weighted_ % kModulus;
        n %= kModulus;
        return uint32_t((n + n * sum + kModulus - weighted) % kModulus << 16 | (1 + sum) % kModulus);
    }

 private:
    static constexpr int64_t kModulus = 65521;
    static uint64_t modulo(int64_t at) { return uint64_t((at % kModulus + kModulus) % kModulus); }

    uint64_t sum_ = 0, weighted_ = 0;
};

}  // namespace fracslice
