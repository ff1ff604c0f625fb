// Lanes as GNU vectors of 32 bytes: AVX2, or whatever the compiler makes of them. Included by lanes.h.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace peers {

template <class T, class Vector, class Bits> struct VectorLanes {
    using Value = T;
    using Mask = std::uint8_t;
    static constexpr int count = 32 / sizeof(T);
    Vector v;

    VectorLanes() = default;
    VectorLanes(Vector lanes) : v(lanes) {}
    explicit VectorLanes(T x) : v(Vector{} + x) {}
    static VectorLanes load(const T* from) {
        VectorLanes lanes;
        std::memcpy(&lanes.v, from, 32);
        return lanes;
    }
    void store(T* to) const { std::memcpy(to, &v, 32); }
    template <class F> friend VectorLanes each(VectorLanes a, F f) {
        for (int i = 0; i < count; ++i) a.v[i] = f(a.v[i]);
        return a;
    }
    friend VectorLanes operator+(VectorLanes a, VectorLanes b) { return a.v + b.v; }
    friend VectorLanes operator-(VectorLanes a, VectorLanes b) { return a.v - b.v; }
    friend VectorLanes operator*(VectorLanes a, VectorLanes b) { return a.v * b.v; }
    friend VectorLanes operator/(VectorLanes a, VectorLanes b) { return a.v / b.v; }
    friend VectorLanes multiply_add(VectorLanes a, VectorLanes b, VectorLanes c) { return a.v * b.v + c.v; }
    friend VectorLanes multiply_subtract(VectorLanes a, VectorLanes b, VectorLanes c) { return a.v * b.v - c.v; }
    friend VectorLanes subtract_product(VectorLanes a, VectorLanes b, VectorLanes c) { return c.v - a.v * b.v; }
    friend VectorLanes minimum(VectorLanes a, VectorLanes b) { return a.v < b.v ? a.v : b.v; }
    friend VectorLanes maximum(VectorLanes a, VectorLanes b) { return a.v > b.v ? a.v : b.v; }
    friend VectorLanes absolute(VectorLanes a) { return a.v < 0 ? -a.v : a.v; }
    friend VectorLanes floor(VectorLanes a) {
        return each(a, [](T x) { return std::floor(x); });
    }
    friend VectorLanes sqrt(VectorLanes a) {
        return each(a, [](T x) { return std::sqrt(x); });
    }
    friend VectorLanes inverse_sqrt(VectorLanes a) { return VectorLanes(T(1)) / sqrt(a); }
    friend Mask greater(VectorLanes a, VectorLanes b) {
        const Bits above = a.v > b.v;
        Mask mask = 0;
        for (int i = 0; i < count; ++i) mask |= Mask((above[i] & 1) << i);
        return mask;
    }
    friend VectorLanes select(Mask mask, VectorLanes a, VectorLanes b) {
        Bits chosen;
        for (int i = 0; i < count; ++i) chosen[i] = -(mask >> i & 1);
        return chosen ? a.v : b.v;
    }
    friend VectorLanes log(VectorLanes a) {
        return each(a, [](T x) { return std::log(x); });
    }
};

typedef float FloatVector __attribute__((vector_size(32)));
typedef double DoubleVector __attribute__((vector_size(32)));
typedef std::int32_t FloatBits __attribute__((vector_size(32)));
typedef std::int64_t DoubleBits __attribute__((vector_size(32)));

using FloatLanes = VectorLanes<float, FloatVector, FloatBits>;
using DoubleLanes = VectorLanes<double, DoubleVector, DoubleBits>;

}  // namespace peers
