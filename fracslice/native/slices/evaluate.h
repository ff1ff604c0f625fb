// The field at many points at a time.
#pragma once
#include <algorithm>
#include <bit>
#include <cmath>

#include "slab.h"

namespace fracslice::slices {

constexpr size_t kBatch = 2048;
constexpr double kSurely = 0.99999;  // squared distances are rounded

// Squared distances in units of the lesser step, from squared values.
inline float factor(double bound, const Frame& frame) {
    const double reach = bound * std::min(frame.dx, frame.dy);
    return float(kSurely / (reach * reach));
}

// Points, and what the field is there.
struct Batch {
    alignas(64) float x[kBatch + kSlack], y[kBatch + kSlack], z[kBatch + kSlack], f[kBatch + kSlack];

    void values(const Field& field, size_t n) {
        size_t padded = (n + 63) / 64 * 64;
        std::fill(x + n, x + padded, x[0]), std::fill(y + n, y + padded, y[0]), std::fill(z + n, z + padded, z[0]);
        field.values(x, y, z, f, padded);
        // NaN counts as outside.
        for (size_t i = 0; i < n; ++i) f[i] = f[i] == f[i] ? f[i] : 1;
    }
};

// where(i, x, y, z) sets the place of point i, scene units; take(i, f) gets its value.
template <class Where, class Take>
void Slab::evaluate(size_t n, const Where& where, const Take& take) {
    Batch batch;
    evaluations_ += int64_t(n);
    for (size_t begin = 0; begin < n; begin += kBatch) {
        size_t m = std::min(kBatch, n - begin);
        for (size_t i = 0; i < m; ++i) where(begin + i, batch.x[i], batch.y[i], batch.z[i]);
        batch.values(*field_, m);
        for (size_t i = 0; i < m; ++i) take(begin + i, batch.f[i]);
    }
}

// Of samples; keeps the values. take(ask, signs) for each tile.
template <class Take>
void Slab::evaluate(const Rows<Ask>& asks, const Rim* rim, const Take& take) {
    Batch batch;
    std::array<Signs, kBatch> result;
    std::fill(batch.z, batch.z + kBatch, float(z_[layer_]));
    for (size_t begin = 0, end = 0; begin < asks.size(); begin = end) {
        size_t n = 0;
        for (; end < asks.size() && n + kTile * kTile <= kBatch; ++end) n += size_t(std::popcount(asks[end].samples));
        const std::span some(&asks[begin], end - begin);
        gather(some, *this, x_.data(), y_.data(), batch.x, batch.y);
        batch.values(*field_, n);
        evaluations_ += int64_t(n);
        scatter(some, batch.f, rim, *this, result.data());
        for (size_t i = begin; i < end; ++i) take(asks[i], result[i - begin]);
    }
}

}  // namespace fracslice::slices
