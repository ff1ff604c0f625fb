// What all peers compute: F(p) = distance estimate - iso, inside where F < 0, at cell centres x_i = lo + (i + 0.5) h.
//
// Every estimate is written once, for one point (float, double) and for lanes. The way in which cells of W1 and W2 are
// dropped (`surely_outside`) is a heuristic, not a bound: distance <= 4 * estimate.
#pragma once

#include <stdexcept>
#include <string>

#include "lanes.h"

namespace peers {

constexpr int BULB_ITERATIONS = 10, JULIA_ITERATIONS = 12, MENGER_LEVELS = 4;
constexpr double BAILOUT_SQUARED = 256, JULIA_C[2] = {-0.2, 0.8};

enum class Shape { bulb, julia, menger, sphere };

// A shape in a cube; iso in voxels: half a voxel around the set of an escape-time fractal, which has no inside of its own.
struct Workload {
    Shape shape;
    double lo, hi, iso;
    bool escape_time() const { return shape == Shape::bulb || shape == Shape::julia; }
};

inline Workload workload(const std::string& name) {
    if (name == "W1") return {Shape::bulb, -1.2, 1.2, 0.5};
    if (name == "W2") return {Shape::julia, -1.5, 1.5, 0.5};
    if (name == "W3") return {Shape::menger, -1.2, 1.2, 0};
    if (name == "W4") return {Shape::sphere, -1.2, 1.2, 0};
    throw std::invalid_argument(name + ": expected W1, W2, W3 or W4");
}

// The half of log(r) r / dr at the step where |w| passed the bailout; 0 where it never did.
template <class V> inline V bulb(V cx, V cy, V cz) {
    using T = typename Traits<V>::Value;
    using Mask = typename Traits<V>::Mask;
    V x = cx, y = cy, z = cz, dr(T(1)), r2 = multiply_add(x, x, multiply_add(y, y, z * z));
    V last_r2 = r2, last_dr = dr;
    Mask escaped = 0;
    for (int i = 0; i < BULB_ITERATIONS && escaped != Traits<V>::all; ++i) {
        const V r = r2 * inverse_sqrt(r2);
        dr = multiply_add(r2 * r2 * r2, V(T(8)) * r * dr, V(T(1)));
        const V p2 = maximum(multiply_add(x, x, y * y), V(T(1e-30))), inverse = inverse_sqrt(p2), p = p2 * inverse;
        // (z + i p)^8 and ((x + i y) / p)^8 by squaring
        const V u = x * inverse, v = y * inverse;
        const V a = multiply_subtract(z, z, p2), b = z + z;
        const V a2 = subtract_product(b * b, p2, a * a), b2 = (a + a) * b;
        const V a3 = subtract_product(b2 * b2, p2, a2 * a2), b3 = (a2 + a2) * b2;
        const V c = multiply_subtract(u, u, v * v), d = (u + u) * v;
        const V c2 = multiply_subtract(c, c, d * d), d2 = (c + c) * d;
        const V c3 = multiply_subtract(c2, c2, d2 * d2), d3 = (c2 + c2) * d2, s = b3 * p;
        x = multiply_add(s, c3, cx);
        y = multiply_add(s, d3, cy);
        z = a3 + cz;
        r2 = multiply_add(x, x, multiply_add(y, y, z * z));
        const Mask now = Mask(greater(r2, V(T(BAILOUT_SQUARED))) & ~escaped);
        last_r2 = select(now, r2, last_r2);
        last_dr = select(now, dr, last_dr);
        escaped |= now;  // lanes that escaped run on into infinity, harmlessly
    }
    return select(escaped, V(T(0.25)) * log(last_r2) * sqrt(last_r2) / last_dr, V(T(0)));
}

// Signed: the solid is where the last step of the orbit is at most BAILOUT. No more than twice the distance from outside.
// Formulas and constants are those of fracslice/formulas/mandelbulb.py and escape.py, for power 8.
struct Bulb {
    static constexpr double BAILOUT = 2, ESCAPED_SQUARED = 10, BOX = 1.1040895;
    double last_level = 2 * std::log(BAILOUT), first_level = last_level * std::pow(0.125, BULB_ITERATIONS);
    double least = BAILOUT * BAILOUT * std::exp(-0.2 / BAILOUT), reach_squared = std::pow(BAILOUT + BOX, 0.25);
    double fading = 1 / (2 * reach_squared), fade = 1 + reach_squared * fading;

    template <class V> V operator()(V cx, V cy, V cz) const {
        using T = typename Traits<V>::Value;
        using Mask = typename Traits<V>::Mask;
        const auto all = [](double value) { return V(T(value)); };
        const V one = all(1), tiny = all(1e-30);
        V x = cx, y = cy, z = cz, dr = one, rho2 = multiply_add(x, x, y * y), r2 = multiply_add(z, z, rho2);
        V last_r2 = r2, slope = dr, level = all(first_level);
        double reached = first_level;
        Mask alive = Mask(greater(all(ESCAPED_SQUARED), r2));
        for (int i = 0; i < BULB_ITERATIONS && alive; ++i) {
            rho2 = maximum(rho2, tiny);
            // (z + i rho)^8 over rho, and e^(8 i phi) from e^(2 i phi), by squaring
            V re = z, im = one, norm2 = r2;
            for (int k = 0; k < 3; ++k) {
                const V twice = re + re;
                re = multiply_subtract(twice, re, norm2);
                im = twice * im;
                norm2 = norm2 * norm2;
            }
            const V inverse = inverse_sqrt(rho2), over = y * inverse * inverse;
            V u = subtract_product(y + y, over, one), v = (x + x) * over;
            for (int k = 0; k < 2; ++k) {
                const V twice = v + v;
                v = twice * u;
                u = subtract_product(twice, all(0.5) * twice, one);
            }
            const V r4 = r2 * r2, meridian = r4 * r4 * inverse_sqrt(maximum(r2, tiny));
            const V latitude = absolute(im) * minimum(one, subtract_product(r2, all(fading), all(fade)));
            dr = multiply_add(maximum(meridian, latitude), all(8) * dr, one);
            const V s = im * (rho2 * inverse);
            x = multiply_add(s, u, cx);
            y = multiply_add(s, v, cy);
            z = re + cz;
            rho2 = multiply_add(x, x, y * y);
            r2 = multiply_add(z, z, rho2);
            reached *= 8;
            last_r2 = select(alive, r2, last_r2);
            slope = select(alive, maximum(dr, slope), slope);
            level = select(alive, all(reached), level);
            alive &= Mask(greater(all(ESCAPED_SQUARED), r2));
        }
        last_r2 = minimum(maximum(last_r2, all(least)), all(1e30));
        level = minimum(level, all(last_level));
        const V height = log(last_r2), damping = multiply_add(all(2 * first_level), height, level + level);
        return (height - level) * (level * maximum(sqrt(last_r2) / slope, tiny)) / damping;
    }
};

template <class V> inline V julia(V x, V y, V z) {
    using T = typename Traits<V>::Value;
    using Mask = typename Traits<V>::Mask;
    V d2(T(1)), r2 = multiply_add(x, x, multiply_add(y, y, z * z)), last_r2 = r2, last_d2 = d2;
    Mask escaped = 0;
    for (int i = 0; i < JULIA_ITERATIONS && escaped != Traits<V>::all; ++i) {
        d2 = (V(T(4)) * r2) * d2;
        const V real = multiply_add(x, x, V(T(JULIA_C[0]))) - multiply_add(y, y, z * z), twice = x + x;
        y = multiply_add(twice, y, V(T(JULIA_C[1])));
        z = twice * z;
        x = real;
        r2 = multiply_add(x, x, multiply_add(y, y, z * z));
        const Mask now = Mask(greater(r2, V(T(BAILOUT_SQUARED))) & ~escaped);
        last_r2 = select(now, r2, last_r2);
        last_d2 = select(now, d2, last_d2);
        escaped |= now;
    }
    return select(escaped, V(T(0.25)) * log(last_r2) * sqrt(last_r2 / last_d2), V(T(0)));
}

template <class V> inline V menger(V x, V y, V z) {
    using T = typename Traits<V>::Value;
    const V zero(T(0)), one(T(1)), two(T(2)), three(T(3)), half(T(0.5));
    const V ax = absolute(x) - one, ay = absolute(y) - one, az = absolute(z) - one;
    const V ox = maximum(ax, zero), oy = maximum(ay, zero), oz = maximum(az, zero);
    V d = sqrt(multiply_add(ox, ox, multiply_add(oy, oy, oz * oz))) + minimum(maximum(ax, maximum(ay, az)), zero);
    T scale = 1;
    for (int level = 0; level < MENGER_LEVELS; ++level) {
        const auto folded = [&](V a) {
            const V q = a * V(scale);
            return absolute(subtract_product(three, absolute(subtract_product(two, floor(q * half), q) - one), one));
        };
        const V rx = folded(x), ry = folded(y), rz = folded(z);
        scale *= 3;
        const V bars = minimum(maximum(rx, ry), minimum(maximum(ry, rz), maximum(rz, rx)));
        d = maximum(d, (bars - one) * V(1 / scale));
    }
    return d;
}

template <class V> inline V sphere(V x, V y, V z) {
    return sqrt(multiply_add(x, x, multiply_add(y, y, z * z))) - V(typename Traits<V>::Value(1));
}

template <class V> inline V estimate(Shape shape, V x, V y, V z) {
    switch (shape) {
        case Shape::bulb: return bulb(x, y, z);
        case Shape::julia: return julia(x, y, z);
        case Shape::menger: return menger(x, y, z);
        default: return sphere(x, y, z);
    }
}

// A workload at a resolution, float32.
struct Grid {
    Workload work;
    int n;
    float lo, h, iso;

    Grid(const Workload& of, int resolution)
        : work(of), n(resolution), lo(float(of.lo)), h(float((of.hi - of.lo) / resolution)),
          iso(float(of.iso * (of.hi - of.lo) / resolution)) {}

    // 1: the block of side s has no inside sample, -1: no outside sample, 0: not known.
    int classify(int x, int y, int z, int s) const {
        const float half = 0.5f * s, reach = (half + 1) * 1.7320508f * h;
        const float d = estimate(work.shape, lo + (x + half) * h, lo + (y + half) * h, lo + (z + half) * h);
        if (work.escape_time()) return d > reach + 4 * iso ? 1 : 0;
        return d > reach ? 1 : d < -reach ? -1 : 0;
    }
};

}  // namespace peers
