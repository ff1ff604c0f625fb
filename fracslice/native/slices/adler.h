// The checksum of a zlib stream (RFC 1950) from parts in any order.
#pragma once
#include <array>
#include <cstdint>

namespace fracslice {

// With d_i the n bytes: 1 + sum d_i, and n + sum (n - i) d_i, modulo 65521.
class Adler {
 public:
    // Rows of so many equal bytes, the first from place `at` on, `stride` places from row to row.
    void add(uint64_t value, int64_t at, uint64_t rows, uint64_t columns, uint64_t stride) {
        const uint64_t both = rows * columns;
        sum_ += value * both;
        weighted_ += value * ((both * modulo(at) + columns * stride * (rows * (rows - 1) / 2)) % kModulus);
        weighted_ += value * (columns * (columns - 1) / 2 % kModulus * rows);
    }
    // Eight rows of eight bytes.
    void add(const std::array<uint8_t, 64>& bytes, int64_t at, uint64_t stride) {
        uint32_t all = 0, rows = 0, columns = 0;
        for (uint32_t i = 0; i < 64; ++i) all += bytes[i], rows += (i >> 3) * bytes[i], columns += (i & 7) * bytes[i];
        sum_ += all;
        weighted_ += all * modulo(at) + stride * rows + columns;
    }
    // Of n bytes in all.
    uint32_t value(uint64_t n) const {
        const uint64_t sum = sum_ % kModulus, weighted = weighted_ % kModulus;
        n %= kModulus;
        return uint32_t((n + n * sum + kModulus - weighted) % kModulus << 16 | (1 + sum) % kModulus);
    }

 private:
    static constexpr int64_t kModulus = 65521;
    // Places before the first byte, of parts that are cut off, are less than a row of eight tiles away.
    static uint64_t modulo(int64_t at) { return uint64_t((at % kModulus + kModulus) % kModulus); }

    uint64_t sum_ = 0, weighted_ = 0;
};

}  // namespace fracslice
