// A field at many points, as native code evaluates it.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace fracslice::volume {

// Coordinates of n points, and what the field is there: rows of n numbers.
struct Rows {
    const double *x, *y, *z;
    double* f;
};
using FieldValues = std::function<void(const Rows& rows, size_t n)>;

// Points whose number grows.
struct Points {
    std::vector<double> x, y, z, f;

    void clear() { x.clear(), y.clear(), z.clear(); }
    size_t size() const { return x.size(); }
    void push(const std::array<double, 3>& p) { x.push_back(p[0]), y.push_back(p[1]), z.push_back(p[2]); }
    std::array<double, 3> operator[](size_t i) const { return {x[i], y[i], z[i]}; }

    // The field at all of them, in f.
    void evaluate(const FieldValues& field) {
        f.resize(size());
        if (size()) field({x.data(), y.data(), z.data(), f.data()}, size());
    }
};

constexpr size_t kPointsAtOnce = 1024;  // they stay in the fastest cache; a multiple of all numbers of lanes

// Machine code run(x, y, z, f, n) on rows of Real, n a multiple of 64.
template <class Real, class Run>
FieldValues in_batches(Run run) {
    return [run](const Rows& rows, size_t n) {
        alignas(64) Real batch[4][kPointsAtOnce];
        for (size_t begin = 0; begin < n; begin += kPointsAtOnce) {
            size_t m = std::min(n - begin, kPointsAtOnce), padded = (m + 63) / 64 * 64, k = 0;
            for (const double* row : {rows.x, rows.y, rows.z}) {
                for (size_t i = 0; i < m; ++i) batch[k][i] = Real(row[begin + i]);
                std::fill(batch[k] + m, batch[k] + padded, Real(0));
                ++k;
            }
            run(batch[0], batch[1], batch[2], batch[3], padded);
            std::copy_n(batch[3], m, rows.f + begin);
        }
    };
}

}  // namespace fracslice::volume
