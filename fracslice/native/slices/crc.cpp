#include "crc.h"

#include <array>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#define FRACSLICE_FOLDS __attribute__((target("pclmul")))
#endif

namespace fracslice {
namespace {

// Polynomials over bits, the highest power lowest: times x, modulo that of ISO 3309.
constexpr uint32_t times_x(uint32_t p) { return p >> 1 ^ (p & 1 ? 0xEDB88320 : 0); }

constexpr size_t kAtOnce = 16;  // bytes

// What a byte adds that is followed by n others.
constexpr auto kTables = [] {
    std::array<std::array<uint32_t, 256>, kAtOnce> tables{};
    for (uint32_t byte = 0; byte < 256; ++byte) {
        uint32_t p = byte;
        for (size_t n = 0; n < kAtOnce; ++n) {
            for (int bit = 0; bit < 8; ++bit) p = times_x(p);
            tables[n][byte] = p;
        }
    }
    return tables;
}();

// Many bytes at once by a table for each (Kounavis and Berry 2005).
uint32_t by_tables(const uint8_t* data, size_t n, uint32_t state) {
    for (; n >= kAtOnce; n -= kAtOnce, data += kAtOnce) {
        uint32_t next = 0;
        for (size_t i = 0; i < kAtOnce; ++i)
            next ^= kTables[kAtOnce - 1 - i][data[i] ^ (i < 4 ? state >> 8 * i & 255 : 0)];
        state = next;
    }
    for (; n; --n) state = state >> 8 ^ kTables[0][(state ^ *data++) & 255];
    return state;
}

#if defined(FRACSLICE_FOLDS)
const bool kFolds = __builtin_cpu_supports("pclmul");

// x^n, as a carry-less product of reflected words needs it.
constexpr int64_t power(int n) {
    uint32_t p = uint32_t(1) << 31;
    for (; n; --n) p = times_x(p);
    return int64_t(p) << 1;
}

// What 16 bytes are worth so many bits further on, with what is there.
template <int bits>
FRACSLICE_FOLDS inline __m128i fold(__m128i from, __m128i to) {
    constexpr int64_t high = power(bits - 32), low = power(bits + 32);
    const __m128i by = _mm_set_epi64x(high, low);
    return _mm_clmulepi64_si128(from, by, 0x00) ^ _mm_clmulepi64_si128(from, by, 0x11) ^ to;
}

// Folding (Gopal et al. 2009): 64 bytes at a time, then into 16 bytes of the same remainder. n: at least 64.
FRACSLICE_FOLDS uint32_t folded(const uint8_t* data, size_t n, uint32_t state) {
    const auto at = [&](size_t i) FRACSLICE_FOLDS { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(data) + i); };
    __m128i a = at(0) ^ _mm_cvtsi32_si128(int(state)), b = at(1), c = at(2), d = at(3);
    for (data += 64, n -= 64; n >= 64; data += 64, n -= 64)
        a = fold<512>(a, at(0)), b = fold<512>(b, at(1)), c = fold<512>(c, at(2)), d = fold<512>(d, at(3));
    a = fold<128>(fold<128>(fold<128>(a, b), c), d);
    uint8_t last[16];
    std::memcpy(last, &a, sizeof last);
    return by_tables(data, n, by_tables(last, sizeof last, 0));
}
#endif

}  // namespace

uint32_t crc32(const uint8_t* data, size_t n, uint32_t before) {
#if defined(FRACSLICE_FOLDS)
    if (kFolds && n >= 64) return ~folded(data, n, ~before);
#endif
    return ~by_tables(data, n, ~before);
}

}  // namespace fracslice
