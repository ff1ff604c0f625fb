// The boxes of the triangles of a leaf, so that one can be held against all of them at once.
#pragma once
#include <cmath>
#include <cstdint>
#include <limits>

#include "triangles.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace fracslice::mesh {

// Rounded to float32 and outwards: boxes that meet meet still, and for float32 coordinates no others.
inline float below(double x) {
    float rounded = float(x);
    return rounded > x ? std::nextafter(rounded, -std::numeric_limits<float>::infinity()) : rounded;
}
inline float above(double x) { return -below(-x); }

struct Box {
    float low[3], high[3];
};

inline Box box_of(const double* low, const double* high) {
    return {{below(low[0]), below(low[1]), below(low[2])}, {above(high[0]), above(high[1]), above(high[2])}};
}

struct LeafBoxes {
    float low[3][kLeaf], high[3][kLeaf];

    void set(size_t lane, const double* a, const double* b, const double* c) {
        for (int k = 0; k < 3; ++k) {
            low[k][lane] = below(std::min(a[k], std::min(b[k], c[k])));
            high[k][lane] = above(std::max(a[k], std::max(b[k], c[k])));
        }
    }

    // A box that meets none.
    void clear(size_t lane) {
        for (int k = 0; k < 3; ++k) {
            low[k][lane] = std::numeric_limits<float>::infinity();
            high[k][lane] = -std::numeric_limits<float>::infinity();
        }
    }

    Box operator[](size_t lane) const {
        return {{low[0][lane], low[1][lane], low[2][lane]}, {high[0][lane], high[1][lane], high[2][lane]}};
    }

    // A bit for each box that meets another.
    unsigned meeting(const Box& box) const {
        unsigned result = 0;
#if defined(__SSE2__)
        for (size_t lane = 0; lane < kLeaf; lane += 4) {
            __m128 meets = _mm_castsi128_ps(_mm_set1_epi32(-1));
            for (int k = 0; k < 3; ++k) {
                meets = _mm_and_ps(meets, _mm_cmple_ps(_mm_loadu_ps(low[k] + lane), _mm_set1_ps(box.high[k])));
                meets = _mm_and_ps(meets, _mm_cmpge_ps(_mm_loadu_ps(high[k] + lane), _mm_set1_ps(box.low[k])));
            }
            result |= unsigned(_mm_movemask_ps(meets)) << lane;
        }
#else
        for (size_t lane = 0; lane < kLeaf; ++lane) {
            bool meets = true;
            for (int k = 0; k < 3; ++k) meets &= low[k][lane] <= box.high[k] && high[k][lane] >= box.low[k];
            result |= unsigned(meets) << lane;
        }
#endif
        return result;
    }
};

}  // namespace fracslice::mesh
