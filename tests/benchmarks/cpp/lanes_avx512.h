// Lanes of AVX-512 registers. Included by lanes.h.
#pragma once

#include <immintrin.h>

namespace peers {

struct FloatLanes {
    using Value = float;
    using Mask = __mmask16;
    static constexpr int count = 16;
    __m512 v;

    FloatLanes() = default;
    FloatLanes(__m512 lanes) : v(lanes) {}
    explicit FloatLanes(float x) : v(_mm512_set1_ps(x)) {}
    static FloatLanes load(const float* from) { return _mm512_loadu_ps(from); }
    void store(float* to) const { _mm512_storeu_ps(to, v); }
    friend FloatLanes operator+(FloatLanes a, FloatLanes b) { return _mm512_add_ps(a.v, b.v); }
    friend FloatLanes operator-(FloatLanes a, FloatLanes b) { return _mm512_sub_ps(a.v, b.v); }
    friend FloatLanes operator*(FloatLanes a, FloatLanes b) { return _mm512_mul_ps(a.v, b.v); }
    friend FloatLanes operator/(FloatLanes a, FloatLanes b) { return _mm512_div_ps(a.v, b.v); }
    friend FloatLanes multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) { return _mm512_fmadd_ps(a.v, b.v, c.v); }
    friend FloatLanes multiply_subtract(FloatLanes a, FloatLanes b, FloatLanes c) {
        return _mm512_fmsub_ps(a.v, b.v, c.v);
    }
    friend FloatLanes subtract_product(FloatLanes a, FloatLanes b, FloatLanes c) {
        return _mm512_fnmadd_ps(a.v, b.v, c.v);
    }
    friend FloatLanes minimum(FloatLanes a, FloatLanes b) { return _mm512_min_ps(a.v, b.v); }
    friend FloatLanes maximum(FloatLanes a, FloatLanes b) { return _mm512_max_ps(a.v, b.v); }
    friend FloatLanes absolute(FloatLanes a) { return _mm512_abs_ps(a.v); }
    friend FloatLanes floor(FloatLanes a) {
        return _mm512_roundscale_ps(a.v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
    }
    friend FloatLanes sqrt(FloatLanes a) { return _mm512_sqrt_ps(a.v); }
    friend FloatLanes inverse_sqrt(FloatLanes a) {
        const FloatLanes y = _mm512_rsqrt14_ps(a.v), half = a * FloatLanes(0.5f);
        return y * subtract_product(half * y, y, FloatLanes(1.5f));
    }
    friend FloatLanes inverse(FloatLanes a) {
        const FloatLanes y = _mm512_rcp14_ps(a.v);
        return y * subtract_product(a, y, FloatLanes(2.0f));
    }
    friend Mask greater(FloatLanes a, FloatLanes b) { return _mm512_cmp_ps_mask(a.v, b.v, _CMP_GT_OQ); }
    friend FloatLanes select(Mask mask, FloatLanes a, FloatLanes b) { return _mm512_mask_blend_ps(mask, b.v, a.v); }
    friend FloatLanes log(FloatLanes a) {
        const __m512 mantissa = _mm512_getmant_ps(a.v, _MM_MANT_NORM_p75_1p5, _MM_MANT_SIGN_src);
        const Mask halved = _mm512_cmp_ps_mask(mantissa, _mm512_set1_ps(1), _CMP_LT_OQ);
        const __m512 exponent = _mm512_getexp_ps(a.v);
        const FloatLanes e = _mm512_mask_add_ps(exponent, halved, exponent, _mm512_set1_ps(1)), m = mantissa;
        const FloatLanes s = (m - FloatLanes(1.0f)) * inverse(m + FloatLanes(1.0f)), squared = s * s;
        FloatLanes sum(2.0f / 9);
        for (int k = 7; k >= 1; k -= 2) sum = multiply_add(sum, squared, FloatLanes(2.0f / k));
        return multiply_add(e, FloatLanes(0.69314718056f), s * sum);
    }
};

struct DoubleLanes {
    using Value = double;
    using Mask = __mmask8;
    static constexpr int count = 8;
    __m512d v;

    DoubleLanes() = default;
    DoubleLanes(__m512d lanes) : v(lanes) {}
    explicit DoubleLanes(double x) : v(_mm512_set1_pd(x)) {}
    static DoubleLanes load(const double* from) { return _mm512_loadu_pd(from); }
    void store(double* to) const { _mm512_storeu_pd(to, v); }
    friend DoubleLanes operator+(DoubleLanes a, DoubleLanes b) { return _mm512_add_pd(a.v, b.v); }
    friend DoubleLanes operator-(DoubleLanes a, DoubleLanes b) { return _mm512_sub_pd(a.v, b.v); }
    friend DoubleLanes operator*(DoubleLanes a, DoubleLanes b) { return _mm512_mul_pd(a.v, b.v); }
    friend DoubleLanes operator/(DoubleLanes a, DoubleLanes b) { return _mm512_div_pd(a.v, b.v); }
    friend DoubleLanes multiply_add(DoubleLanes a, DoubleLanes b, DoubleLanes c) {
        return _mm512_fmadd_pd(a.v, b.v, c.v);
    }
    friend DoubleLanes multiply_subtract(DoubleLanes a, DoubleLanes b, DoubleLanes c) {
        return _mm512_fmsub_pd(a.v, b.v, c.v);
    }
    friend DoubleLanes subtract_product(DoubleLanes a, DoubleLanes b, DoubleLanes c) {
        return _mm512_fnmadd_pd(a.v, b.v, c.v);
    }
    friend DoubleLanes minimum(DoubleLanes a, DoubleLanes b) { return _mm512_min_pd(a.v, b.v); }
    friend DoubleLanes maximum(DoubleLanes a, DoubleLanes b) { return _mm512_max_pd(a.v, b.v); }
    friend DoubleLanes absolute(DoubleLanes a) { return _mm512_abs_pd(a.v); }
    friend DoubleLanes floor(DoubleLanes a) {
        return _mm512_roundscale_pd(a.v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
    }
    friend DoubleLanes sqrt(DoubleLanes a) { return _mm512_sqrt_pd(a.v); }
    friend DoubleLanes inverse_sqrt(DoubleLanes a) {
        DoubleLanes y = _mm512_rsqrt14_pd(a.v);
        const DoubleLanes half = a * DoubleLanes(0.5), one_half(1.5);
        y = y * subtract_product(half * y, y, one_half);
        return y * subtract_product(half * y, y, one_half);
    }
    friend Mask greater(DoubleLanes a, DoubleLanes b) { return _mm512_cmp_pd_mask(a.v, b.v, _CMP_GT_OQ); }
    friend DoubleLanes select(Mask mask, DoubleLanes a, DoubleLanes b) { return _mm512_mask_blend_pd(mask, b.v, a.v); }
    friend DoubleLanes log(DoubleLanes a) {
        const __m512d mantissa = _mm512_getmant_pd(a.v, _MM_MANT_NORM_p75_1p5, _MM_MANT_SIGN_src);
        const Mask halved = _mm512_cmp_pd_mask(mantissa, _mm512_set1_pd(1), _CMP_LT_OQ);
        const __m512d exponent = _mm512_getexp_pd(a.v);
        const DoubleLanes e = _mm512_mask_add_pd(exponent, halved, exponent, _mm512_set1_pd(1)), m = mantissa;
        const DoubleLanes s = (m - DoubleLanes(1.0)) / (m + DoubleLanes(1.0)), squared = s * s;
        DoubleLanes sum(2.0 / 21);
        for (int k = 19; k >= 1; k -= 2) sum = multiply_add(sum, squared, DoubleLanes(2.0 / k));
        return multiply_add(e, DoubleLanes(0.693147180559945309417), s * sum);
    }
};

}  // namespace peers
