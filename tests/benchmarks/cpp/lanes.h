// Points side by side, as the peers evaluate them: AVX-512 where there is one, else vectors of the compiler's own width.
//
// A type of lanes V has V::Value, V::Mask and V::count; V(x), V::load, store; + - * /; multiply_add(a, b, c) = a b + c,
// multiply_subtract = a b - c, subtract_product = c - a b; minimum, maximum, absolute, floor, sqrt, inverse_sqrt, log;
// greater and select(mask, a, b). A mask is a whole number with one bit a lane.
#pragma once

#include <cmath>
#include <cstdint>

#ifdef __AVX512F__
#include "lanes_avx512.h"
#else
#include "lanes_portable.h"
#endif

namespace peers {

// One point alone, in the same words.
template <class T> inline T multiply_add(T a, T b, T c) { return a * b + c; }
template <class T> inline T multiply_subtract(T a, T b, T c) { return a * b - c; }
template <class T> inline T subtract_product(T a, T b, T c) { return c - a * b; }
inline float minimum(float a, float b) { return a < b ? a : b; }
inline double minimum(double a, double b) { return a < b ? a : b; }
inline float maximum(float a, float b) { return a > b ? a : b; }
inline double maximum(double a, double b) { return a > b ? a : b; }
inline float absolute(float a) { return std::fabs(a); }
inline double absolute(double a) { return std::fabs(a); }
inline float floor(float a) { return std::floor(a); }
inline double floor(double a) { return std::floor(a); }
inline float sqrt(float a) { return std::sqrt(a); }
inline double sqrt(double a) { return std::sqrt(a); }
inline float inverse_sqrt(float a) { return 1 / std::sqrt(a); }
inline double inverse_sqrt(double a) { return 1 / std::sqrt(a); }
inline float log(float a) { return std::log(a); }
inline double log(double a) { return std::log(a); }
inline unsigned greater(float a, float b) { return a > b; }
inline unsigned greater(double a, double b) { return a > b; }
inline float select(unsigned mask, float a, float b) { return mask ? a : b; }
inline double select(unsigned mask, double a, double b) { return mask ? a : b; }

template <class V> struct Traits {
    using Value = typename V::Value;
    using Mask = typename V::Mask;
    static constexpr Mask all = V::count == 8 * sizeof(Mask) ? Mask(~Mask(0)) : Mask((std::uint64_t(1) << V::count) - 1);
};
template <> struct Traits<float> {
    using Value = float;
    using Mask = unsigned;
    static constexpr Mask all = 1;
};
template <> struct Traits<double> {
    using Value = double;
    using Mask = unsigned;
    static constexpr Mask all = 1;
};

// Two of them in flight hide the latency of the arithmetic.
template <class V> struct Pair {
    using Value = typename V::Value;
    using Mask = std::uint32_t;
    static constexpr int count = 2 * V::count;
    V a, b;

    Pair() = default;
    Pair(V first, V second) : a(first), b(second) {}
    explicit Pair(Value x) : a(x), b(x) {}
    static Pair load(const Value* from) { return {V::load(from), V::load(from + V::count)}; }
    void store(Value* to) const {
        a.store(to);
        b.store(to + V::count);
    }
    friend Pair operator+(Pair x, Pair y) { return {x.a + y.a, x.b + y.b}; }
    friend Pair operator-(Pair x, Pair y) { return {x.a - y.a, x.b - y.b}; }
    friend Pair operator*(Pair x, Pair y) { return {x.a * y.a, x.b * y.b}; }
    friend Pair operator/(Pair x, Pair y) { return {x.a / y.a, x.b / y.b}; }
    friend Pair multiply_add(Pair x, Pair y, Pair z) {
        return {multiply_add(x.a, y.a, z.a), multiply_add(x.b, y.b, z.b)};
    }
    friend Pair multiply_subtract(Pair x, Pair y, Pair z) {
        return {multiply_subtract(x.a, y.a, z.a), multiply_subtract(x.b, y.b, z.b)};
    }
    friend Pair subtract_product(Pair x, Pair y, Pair z) {
        return {subtract_product(x.a, y.a, z.a), subtract_product(x.b, y.b, z.b)};
    }
    friend Pair minimum(Pair x, Pair y) { return {minimum(x.a, y.a), minimum(x.b, y.b)}; }
    friend Pair maximum(Pair x, Pair y) { return {maximum(x.a, y.a), maximum(x.b, y.b)}; }
    friend Pair absolute(Pair x) { return {absolute(x.a), absolute(x.b)}; }
    friend Pair floor(Pair x) { return {floor(x.a), floor(x.b)}; }
    friend Pair sqrt(Pair x) { return {sqrt(x.a), sqrt(x.b)}; }
    friend Pair inverse_sqrt(Pair x) { return {inverse_sqrt(x.a), inverse_sqrt(x.b)}; }
    friend Pair log(Pair x) { return {log(x.a), log(x.b)}; }
    friend Mask greater(Pair x, Pair y) {
        return Mask(greater(x.a, y.a)) | Mask(greater(x.b, y.b)) << V::count;
    }
    friend Pair select(Mask mask, Pair x, Pair y) {
        using Half = typename V::Mask;
        return {select(Half(mask), x.a, y.a), select(Half(mask >> V::count), x.b, y.b)};
    }
};

using Floats = Pair<FloatLanes>;
using Doubles = Pair<DoubleLanes>;

}  // namespace peers
