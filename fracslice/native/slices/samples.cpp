#include "samples.h"

#include <cstdlib>

#include "avx512.h"
#include "bits.h"

namespace fracslice::slices {
namespace {

void gather_each(std::span<const Ask> asks, const Tiles& tiles, const float* x, const float* y, float* to_x, float* to_y) {
    for (const Ask& ask : asks) {
        const Place& p = tiles.place[ask.tile];
        const float *columns = x + kTile * (p.x - 1), *rows = y + kTile * (p.y - 1);
        each(ask.samples, [&](int bit) { *to_x++ = columns[bit & 7], *to_y++ = rows[bit >> 3]; });
    }
}

void scatter_each(std::span<const Ask> asks, const float* f, const Rim* rim, Tiles& tiles, Signs* result) {
    for (size_t i = 0; i < asks.size(); ++i) {
        float* kept = tiles.values[asks[i].tile].data();
        Signs all{};
        const float factors[] = {rim ? rim->outside[asks[i].tile] : 0, rim ? rim->inside : 0};
        each(asks[i].samples, [&](int bit) {
            const float v = *f++;
            const bool negative = v < 0;
            all.negative |= uint64_t(negative) << bit;
            kept[bit] = v;
            if (!rim) return;
            const float scaled = v * v * factors[negative];
            all.beyond |= uint64_t(scaled > rim->least) << bit;
            all.calm |= uint64_t(negative | (scaled > rim->calm)) << bit;
        });
        result[i] = all;
    }
}

#if defined(FRACSLICE_WIDE)
// With AVX-512 a list of samples is never walked one by one, which would take longer than the field of many.

// Sixteen samples at a time, the chosen ones first brought together.
FRACSLICE_WIDE void gather_wide(std::span<const Ask> asks, const Tiles& tiles, const float* x, const float* y, float* to_x,
                                float* to_y) {
    for (const Ask& ask : asks) {
        const Place& p = tiles.place[ask.tile];
        const __m512 columns = _mm512_castps256_ps512(_mm256_loadu_ps(x + kTile * (p.x - 1)));
        const __m512 rows = _mm512_castps256_ps512(_mm256_loadu_ps(y + kTile * (p.y - 1)));
        const SetBits bits(ask.samples);
        for (int at = 0; at < bits.count; at += 16) {
            const __m512i bit = bits.sixteen(at);
            const __m512i column = _mm512_and_si512(bit, _mm512_set1_epi32(7)), row = _mm512_maskz_srli_epi32(0xFFFF, bit, 3);
            _mm512_storeu_ps(to_x + at, _mm512_maskz_permutexvar_ps(0xFFFF, column, columns));
            _mm512_storeu_ps(to_y + at, _mm512_maskz_permutexvar_ps(0xFFFF, row, rows));
        }
        to_x += bits.count, to_y += bits.count;
    }
}

// How many samples of a word lie before its quarter q.
FRACSLICE_WIDE inline int64_t before(uint64_t word, int q) { return _mm_popcnt_u64(word & ((uint64_t(1) << 16 * q) - 1)); }

template <bool kBeyond>
FRACSLICE_WIDE void scatter_wide(std::span<const Ask> asks, const float* f, const Rim* rim, Tiles& tiles, Signs* result) {
    const __m512 inside = _mm512_set1_ps(kBeyond ? rim->inside : 0);
    const __m512 least = _mm512_set1_ps(kBeyond ? rim->least : 0), calm = _mm512_set1_ps(kBeyond ? rim->calm : 0);
    for (size_t i = 0; i < asks.size(); ++i) {
        const uint64_t samples = asks[i].samples;
        const int64_t count = _mm_popcnt_u64(samples);
        float* kept = tiles.values[asks[i].tile].data();
        for (int q = 0; q < 4; ++q) {
            const __mmask16 chosen = __mmask16(samples >> 16 * q);
            const __m512 v = _mm512_loadu_ps(f + before(samples, q));
            _mm512_mask_storeu_ps(kept + 16 * q, chosen, _mm512_maskz_expand_ps(chosen, v));
        }
        const __m512 outside = _mm512_set1_ps(kBeyond ? rim->outside[asks[i].tile] : 0);
        uint64_t negative = 0, beyond = 0, enough = 0;
        for (int64_t at = 0; at < count; at += 16) {
            const __m512 v = _mm512_loadu_ps(f + at);
            const __mmask16 below = _mm512_cmp_ps_mask(v, _mm512_setzero_ps(), _CMP_LT_OQ);
            negative |= uint64_t(below) << at;
            if (!kBeyond) continue;
            const __m512 scaled = _mm512_mul_ps(_mm512_mul_ps(v, v), _mm512_mask_blend_ps(below, outside, inside));
            beyond |= uint64_t(_mm512_cmp_ps_mask(scaled, least, _CMP_GT_OQ)) << at;
            enough |= uint64_t(__mmask16(below | _mm512_cmp_ps_mask(scaled, calm, _CMP_GT_OQ))) << at;
        }
        result[i] = {_pdep_u64(negative, samples), _pdep_u64(beyond, samples), _pdep_u64(enough, samples)};
        f += count;
    }
}

#endif

}  // namespace

bool has_wide() {
#if defined(FRACSLICE_WIDE)
    return !std::getenv("FRACSLICE_PORTABLE") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vbmi") &&
           __builtin_cpu_supports("avx512vbmi2") && __builtin_cpu_supports("bmi2");
#else
    return false;
#endif
}

void gather(std::span<const Ask> asks, const Tiles& tiles, const float* x, const float* y, float* to_x, float* to_y) {
#if defined(FRACSLICE_WIDE)
    if (kWide) return gather_wide(asks, tiles, x, y, to_x, to_y);
#endif
    gather_each(asks, tiles, x, y, to_x, to_y);
}

void scatter(std::span<const Ask> asks, const float* f, const Rim* rim, Tiles& tiles, Signs* result) {
#if defined(FRACSLICE_WIDE)
    if (kWide) return (rim ? scatter_wide<true> : scatter_wide<false>)(asks, f, rim, tiles, result);
#endif
    scatter_each(asks, f, rim, tiles, result);
}

}  // namespace fracslice::slices
