// Functions for machines that have AVX-512, beside those for any machine.
#pragma once
#include <array>
#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#define FRACSLICE_WIDE __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi,avx512vbmi2,bmi,bmi2,popcnt")))
#endif

namespace fracslice::slices {

// True if this machine has AVX-512; an environment variable turns it off, so that tests run both paths.
bool has_wide();
inline const bool kWide = has_wide();

#if defined(FRACSLICE_WIDE)
alignas(64) inline constexpr auto kNumbers = [] {
    std::array<uint8_t, 64> numbers{};
    for (int i = 0; i < 64; ++i) numbers[i] = uint8_t(i);
    return numbers;
}();

// The numbers of the bits of a word that are set, ascending.
class SetBits {
 public:
    FRACSLICE_WIDE explicit SetBits(uint64_t word) : count(int(_mm_popcnt_u64(word))) {
        _mm512_store_si512(numbers_, _mm512_maskz_compress_epi8(word, _mm512_load_si512(kNumbers.data())));
    }
    // Sixteen of them from the one `at` on, a multiple of 16; behind the last one are zeros.
    FRACSLICE_WIDE __m512i sixteen(int at) const {
        return _mm512_maskz_cvtepu8_epi32(0xFFFF, _mm_load_si128(reinterpret_cast<const __m128i*>(numbers_ + at)));
    }
    const int count;

 private:
    alignas(64) uint8_t numbers_[64];
};
#endif

}  // namespace fracslice::slices
