#include "coverage.h"

#include <cstring>

#include "avx512.h"

namespace fracslice::slices {
namespace {

constexpr int kEnds = kTile + 1;  // samples along a row of cells
constexpr float kLeast = 1e-15f, kMost = 1e12f;  // values, so that products of scaled ones are numbers

// Four samples or cells side by side.
using Four = float __attribute__((vector_size(16)));
using Word = int32_t __attribute__((vector_size(16)));

Four load(const float* from) {
    Four four;
    std::memcpy(&four, from, sizeof four);
    return four;
}
void store(const Four& four, float* to) { std::memcpy(to, &four, sizeof four); }

// The inside parts of all sides of the cells of a tile.
struct Parts {
    float across[kEnds][kTile], up[kTile][kEnds];
};

// All ones where the bits from `first` on are set.
Word mask(uint64_t word, int first) {
    const Word columns = {1, 2, 4, 8};
    return (columns & int32_t(word >> first & 15)) != 0;
}
// The first column as a row (Warren 2012, "Hacker's Delight", 7-3).
uint64_t first_column(uint64_t word) { return (word & kFirstColumn) * 0x0102040810204080 >> 56; }

// What samples weigh in the sides between them: all, and those inside; unknown ones are between none that are crossed.
struct Weights {
    float all[kEnds][kEnds], inside[kEnds][kEnds];

    void set(int row, int column, Four values, Word known, Word within, float scale) {
        const Four size = Four(Word(values) & 0x7FFFFFFF), none = {}, one = none + 1, least = none + kLeast, most = none + kMost;
        const Four some = size > least ? size : least;
        Four weight = known ? (some < most ? some : most) : one;
        weight = within ? scale * weight : weight;
        store(weight, &all[row][column]), store(within ? weight : none, &inside[row][column]);
    }
    // Of one row, with those to the right.
    void set(int row, const float* values, uint64_t known, uint64_t within, float scale) {
        for (int i = 0; i < kTile; i += 4) set(row, i, load(values + i), mask(known, i), mask(within, i), scale);
    }
};

// Where the samples' values say that sides are crossed.
void by_values(const Slab& slab, const Quad& tiles, float scale, Parts& parts) {
    const float *own = slab.tiles().values[tiles.own].data(), *right = slab.tiles().values[tiles.right].data();
    const uint64_t known = slab.tiles().known[tiles.own], within = slab.tiles().inside[tiles.own];
    Weights sample, beside;  // the latter: the column to the right, as two rows that are one after the other
    for (int r = 0; r < kTile; ++r) sample.set(r, own + kTile * r, known >> kTile * r, within >> kTile * r, scale);
    sample.set(kTile, slab.tiles().values[tiles.upper].data(), slab.tiles().known[tiles.upper], slab.tiles().inside[tiles.upper], scale);
    float column[kTile];
    for (int r = 0; r < kTile; ++r) column[r] = right[kTile * r];
    beside.set(0, column, first_column(slab.tiles().known[tiles.right]), first_column(slab.tiles().inside[tiles.right]), scale);
    column[0] = slab.tiles().values[tiles.beyond][0];
    beside.set(1, column, slab.tiles().known[tiles.beyond] & 1, slab.tiles().inside[tiles.beyond] & 1, scale);
    beside.all[0][kTile] = beside.all[1][0], beside.inside[0][kTile] = beside.inside[1][0];
    for (int r = 0; r < kEnds; ++r) sample.all[r][kTile] = beside.all[0][r], sample.inside[r][kTile] = beside.inside[0][r];

    for (int i = 0; i < kTile; i += 4) {
        for (int r = 0; r < kTile; ++r) {
            const float *all = &sample.all[r][i], *inside = &sample.inside[r][i];
            const Four u = load(all) + load(all + 1), v = load(all) + load(all + kEnds);
            const Four over = 1 / (u * v);  // one division for both
            store((load(inside) + load(inside + 1)) * v * over, &parts.across[r][i]);
            store((load(inside) + load(inside + kEnds)) * u * over, &parts.up[r][i]);
        }
        const float *all = &sample.all[kTile][i], *inside = &sample.inside[kTile][i];
        store((load(inside) + load(inside + 1)) / (load(all) + load(all + 1)), &parts.across[kTile][i]);
        all = &beside.all[0][i], inside = &beside.inside[0][i];
        store((load(inside) + load(inside + 1)) / (load(all) + load(all + 1)), column + i);
    }
    for (int r = 0; r < kTile; ++r) parts.up[r][kTile] = column[r];
}

// At the evaluated crossings.
void by_crossings(const Slab& slab, const Quad& tiles, const Corners& corners, Parts& parts) {
    const uint16_t *own = slab.tiles().cross[tiles.own].data(), *right = slab.tiles().cross[tiles.right].data();
    auto part = [](float share, bool first, bool second) {
        const float whole = first, inside = first ? share : kWhole - share;
        return first == second ? whole : inside * (1 / kWhole);
    };
    auto is = [](uint64_t word, int bit) { return bool(word >> bit & 1); };
    for (int bit = 0; bit < 64; ++bit) {
        const bool here = is(corners.word[0], bit);
        parts.across[bit >> 3][bit & 7] = part(own[bit], here, is(corners.word[1], bit));
        parts.up[bit >> 3][bit & 7] = part(own[64 + bit], here, is(corners.word[3], bit));
    }
    const uint16_t* upper = slab.tiles().cross[tiles.upper].data();
    for (int i = 0; i < kTile; ++i) {
        const int top = 56 + i, last = kTile * i + 7;
        parts.across[kTile][i] = part(upper[i], is(corners.word[3], top), is(corners.word[2], top));
        parts.up[i][kTile] = part(right[64 + kTile * i], is(corners.word[1], last), is(corners.word[2], last));
    }
}

// Levels, areas, and these added to sums by columns. With b, r, a, l the inside parts of the lower, right, upper and left side
// of a cell that is cut once, of its area (l + r) (a + b) / 2 - l r a b is inside: of a corner l and b alone are not 0, of all
// but a corner two are 1, and of a half one is 0 and the opposite one 1. So it is of one wholly in or out.
void measure(const Parts& parts, Levels& levels, double* sums, float* areas) {
    float sum[2][kTile] = {};
    int32_t whole[64];
    for (int i = 0; i < 64; i += 4) {
        const int row = i / kTile, column = i % kTile;
        const Four b = load(&parts.across[row][column]), a = load(&parts.across[row + 1][column]);
        const Four l = load(&parts.up[row][column]), r = load(&parts.up[row][column + 1]);
        const Four within = (l + r) * (a + b) * 0.5f - l * r * (a * b);
        store(within, areas + i);
        store(load(&sum[row & 1][column]) + within, &sum[row & 1][column]);
        const Word level = __builtin_convertvector(255 * within + 0.5f, Word);
        std::memcpy(whole + i, &level, sizeof level);
    }
    for (int i = 0; i < 64; ++i) levels[size_t(i)] = uint8_t(whole[i]);
    for (int i = 0; i < kTile; ++i) sums[i] += double(sum[0][i] + sum[1][i]);
}

void cover(const Slab& slab, float scale, const Quad& tiles, const Corners& corners, Levels& levels, double* sums,
           float* areas) {
    Parts parts;
    if (scale == 0)
        by_crossings(slab, tiles, corners, parts);
    else
        by_values(slab, tiles, scale, parts);
    measure(parts, levels, sums, areas);
}

#if defined(FRACSLICE_WIDE)
// The same, two rows at a time, with AVX-512.

// The inside parts of the sides of the cells of a tile: lower ones, in the last the upper ones of the last row and then the right
// ones of the last column; and left ones.
struct WideParts {
    __m512 across[5], up[4];
};

// What samples weigh.
FRACSLICE_WIDE __m512 weight(__m512 values, uint64_t known, uint64_t within, __m512 scale) {
    constexpr int size_most = 0b1011;  // of the sizes the larger one
    const __m512 some = _mm512_mask_range_ps(_mm512_set1_ps(1), __mmask16(known), values, _mm512_set1_ps(kLeast), size_most);
    const __m512 weight = _mm512_maskz_min_ps(0xFFFF, some, _mm512_set1_ps(kMost));
    return _mm512_mask_mul_ps(weight, __mmask16(within), weight, scale);
}
// What those weigh that are inside, and with others, of which some are inside.
FRACSLICE_WIDE __m512 inside_of(__m512 weights, uint64_t within, __m512 others, uint64_t others_within) {
    const __m512 inside = _mm512_maskz_mov_ps(__mmask16(within), weights);
    return _mm512_mask_add_ps(inside, __mmask16(others_within), inside, others);
}
// The second row of one and the first of another.
FRACSLICE_WIDE __m512 between(__m512 lower, __m512 upper) {
    return _mm512_maskz_shuffle_f32x4(0xFFFF, lower, upper, _MM_SHUFFLE(1, 0, 3, 2));
}

// For each of two rows: the column to the right.
FRACSLICE_WIDE inline __m512i beside(int i) {
    return _mm512_setr_epi32(1, 2, 3, 4, 5, 6, 7, 24 + 2 * i, 9, 10, 11, 12, 13, 14, 15, 25 + 2 * i);
}

FRACSLICE_WIDE WideParts by_values_wide(const Slab& slab, float scale, const Quad& tiles, const Corners& corners) {
    WideParts parts;
    const float *own = slab.tiles().values[tiles.own].data(), *right = slab.tiles().values[tiles.right].data();
    const uint64_t known = slab.tiles().known[tiles.own], *within = corners.word;
    const __m512 more = _mm512_set1_ps(scale);
    __m512 rows[5];
    for (int i = 0; i < 4; ++i) rows[i] = weight(_mm512_loadu_ps(own + 16 * i), known >> 16 * i, within[0] >> 16 * i, more);
    // The row above, then the column to the right.
    const __m256 column = _mm256_setr_ps(right[0], right[8], right[16], right[24], right[32], right[40], right[48], right[56]);
    const __m512 upper = _mm512_maskz_loadu_ps(0xFF, slab.tiles().values[tiles.upper].data());
    const uint64_t rim_known = (slab.tiles().known[tiles.upper] & kFirstRow) | first_column(slab.tiles().known[tiles.right]) << 8;
    const uint64_t rim_within = within[3] >> 56 | first_column(within[1] >> 7) << 8;
    const uint64_t over_within = within[2] >> 56 | first_column(within[2] >> 7) << 8;
    const __m512 rim = rows[4] = weight(_mm512_maskz_insertf32x8(0xFFFF, upper, column, 1), rim_known, rim_within, more);
    const __m512 corner = weight(_mm512_set1_ps(slab.tiles().values[tiles.beyond][0]), slab.tiles().known[tiles.beyond] & 1 ? 0xFFFF : 0,
                                 within[2] >> 63 ? 0xFFFF : 0, more);

    const __m512i next = _mm512_setr_epi32(1, 2, 3, 4, 5, 6, 7, 16, 9, 10, 11, 12, 13, 14, 15, 16);
    const __m512 over = _mm512_permutex2var_ps(rim, next, corner);
    const __m512 rim_parts = _mm512_div_ps(inside_of(rim, rim_within, over, over_within), _mm512_add_ps(rim, over));
    parts.across[4] = rim_parts;
    for (int i = 0; i < 4; ++i) {
        const int at = 16 * i;
        const __m512 here = rows[i], right_one = _mm512_permutex2var_ps(here, beside(i), rim), above = between(here, rows[i + 1]);
        const __m512 u = _mm512_add_ps(here, right_one), v = _mm512_add_ps(here, above);
        const __m512 u_inside = inside_of(here, within[0] >> at, right_one, within[1] >> at);
        const __m512 v_inside = inside_of(here, within[0] >> at, above, within[3] >> at);
        const __m512 one_over = _mm512_div_ps(_mm512_set1_ps(1), _mm512_mul_ps(u, v));  // one division for both
        parts.across[i] = _mm512_mul_ps(_mm512_mul_ps(u_inside, v), one_over);
        parts.up[i] = _mm512_mul_ps(_mm512_mul_ps(v_inside, u), one_over);
    }
    return parts;
}

// The inside part of sixteen edges with the signs `first` and `second` at their ends, which are crossed at these shares.
FRACSLICE_WIDE inline __m512 part(const uint16_t* shares, uint64_t first, uint64_t second) {
    const __m256i crossed = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(shares));
    const __m512 share = _mm512_maskz_cvtepi32_ps(0xFFFF, _mm512_maskz_cvtepu16_epi32(0xFFFF, crossed));
    const __m512 within = _mm512_mask_sub_ps(share, __mmask16(~first), _mm512_set1_ps(kWhole), share);
    const __m512 whole = _mm512_maskz_mov_ps(__mmask16(first), _mm512_set1_ps(1));
    return _mm512_mask_mul_ps(whole, __mmask16(first ^ second), within, _mm512_set1_ps(1 / kWhole));
}

FRACSLICE_WIDE WideParts by_crossings_wide(const Slab& slab, const Quad& tiles, const Corners& corners) {
    WideParts parts;
    const uint16_t *own = slab.tiles().cross[tiles.own].data(), *right = slab.tiles().cross[tiles.right].data();
    const uint64_t* within = corners.word;
    for (int i = 0; i < 4; ++i) {
        const int at = 16 * i;
        parts.across[i] = part(own + at, within[0] >> at, within[1] >> at);
        parts.up[i] = part(own + 64 + at, within[0] >> at, within[3] >> at);
    }
    uint16_t rim[16];
    std::memcpy(rim, slab.tiles().cross[tiles.upper].data(), kTile * sizeof *rim);
    for (int k = 0; k < kTile; ++k) rim[kTile + k] = right[64 + kTile * k];
    const uint64_t first = within[3] >> 56 | first_column(within[1] >> 7) << 8;
    parts.across[4] = part(rim, first, within[2] >> 56 | first_column(within[2] >> 7) << 8);
    return parts;
}

FRACSLICE_WIDE void cover_wide(const Slab& slab, float scale, const Quad& tiles, const Corners& corners, Levels& levels,
                               double* sums, float* areas) {
    const WideParts parts = scale == 0 ? by_crossings_wide(slab, tiles, corners) : by_values_wide(slab, scale, tiles, corners);
    __m512 sum = _mm512_setzero_ps();
    __m512i level[4];
    for (int i = 0; i < 4; ++i) {
        const __m512 b = parts.across[i], a = between(b, parts.across[i + 1]), l = parts.up[i];
        const __m512 r = _mm512_permutex2var_ps(l, beside(i), parts.across[4]);
        const __m512 half = _mm512_mul_ps(_mm512_mul_ps(_mm512_add_ps(l, r), _mm512_add_ps(a, b)), _mm512_set1_ps(0.5f));
        const __m512 inside = _mm512_sub_ps(half, _mm512_mul_ps(_mm512_mul_ps(l, r), _mm512_mul_ps(a, b)));
        sum = _mm512_add_ps(sum, inside);
        if (areas) _mm512_storeu_ps(areas + 16 * i, inside);
        const __m512 rounded = _mm512_add_ps(_mm512_mul_ps(inside, _mm512_set1_ps(255)), _mm512_set1_ps(0.5f));
        level[i] = _mm512_maskz_cvttps_epi32(0xFFFF, rounded);
    }
    const __m512i low = _mm512_packs_epi32(level[0], level[1]), high = _mm512_packs_epi32(level[2], level[3]);
    const __m512i order = _mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
    const __m512i bytes = _mm512_maskz_permutexvar_epi32(0xFFFF, order, _mm512_packus_epi16(low, high));
    _mm512_storeu_si512(levels.data(), bytes);
    const __m256 both = _mm256_add_ps(_mm512_maskz_extractf32x8_ps(0xFF, sum, 0), _mm512_maskz_extractf32x8_ps(0xFF, sum, 1));
    _mm512_storeu_pd(sums, _mm512_add_pd(_mm512_loadu_pd(sums), _mm512_maskz_cvtps_pd(0xFF, both)));
}
#endif

}  // namespace

void Coverage::operator()(const Quad& tiles, const Corners& corners, Levels& levels) {
    alignas(64) float areas[64];
    const uint64_t alternating = corners.alternating(), special = alternating | slab_.tiles().sharp[tiles.own];
#if defined(FRACSLICE_WIDE)
    if (kWide)
        cover_wide(slab_, scale_, tiles, corners, levels, sums_.data(), special ? areas : nullptr);
    else
#endif
        cover(slab_, scale_, tiles, corners, levels, sums_.data(), areas);
    each(special, [&](int bit) {
        const bool both = alternating >> bit & 1;
        const float within = both ? Cells(slab_, scale_, tiles).area(bit, corners.signs(bit)) : areas[bit];
        const float now = slab_.sharpened(tiles.own, bit, within);
        sums_[0] += double(now - areas[bit]);
        levels[bit] = uint8_t(int(255 * now + 0.5f));
    });
}

}  // namespace fracslice::slices
