// The field at many points at a time.
#pragma once
#include <algorithm>
#include <cmath>

#include "slab.h"

namespace fracslice {

constexpr size_t kBatch = 1024;

// Points, and what the field is there.
struct Batch {
    alignas(64) float x[kBatch], y[kBatch], z[kBatch], f[kBatch];

    void values(const Field& field, size_t n) {
        size_t padded = (n + 63) / 64 * 64;
        std::fill(x + n, x + padded, x[0]), std::fill(y + n, y + padded, y[0]), std::fill(z + n, z + padded, z[0]);
        field.values(x, y, z, f, padded);
        // What is not a number counts as outside.
        for (size_t i = 0; i < n; ++i) f[i] = f[i] == f[i] ? f[i] : 1;
    }
};

// where(i, column, row, z) sets the place of point i on the lattice; take(i, f) gets its value.
template <class Where, class Take>
void Slab::evaluate(size_t n, const Where& where, const Take& take) {
    Batch batch;
    evaluations += int64_t(n);
    for (size_t begin = 0; begin < n; begin += kBatch) {
        size_t m = std::min(kBatch, n - begin);
        for (size_t i = 0; i < m; ++i) {
            double column, row, height;
            where(begin + i, column, row, height);
            batch.x[i] = float(frame_.x0 + frame_.dx * column);
            batch.y[i] = float(frame_.y0 + frame_.dy * row);
            batch.z[i] = float(height);
        }
        batch.values(*field_, m);
        for (size_t i = 0; i < m; ++i) take(begin + i, batch.f[i]);
    }
}

// Of samples; keeps the values. take(ask, f) gets those of a tile's samples, and says which are inside.
template <class Take>
void Slab::evaluate(int layer, const std::vector<Ask>& asks, const Take& take) {
    Batch batch;
    std::fill(batch.z, batch.z + kBatch, float(z_[layer]));
    auto next = asks.begin();
    while (next != asks.end()) {
        auto first = next;
        size_t n = 0;
        for (; next != asks.end() && n + 64 <= kBatch; ++next) {
            const float *x = &x_[kTile * (place[next->tile].x - 1)], *y = &y_[kTile * (place[next->tile].y - 1)];
            each(next->samples, [&](int bit) { batch.x[n] = x[bit & 7], batch.y[n] = y[bit >> 3], ++n; });
        }
        batch.values(*field_, n);
        evaluations += int64_t(n);
        const float* f = batch.f;
        for (; first != next; ++first) f += take(*first, f);
    }
}

}  // namespace fracslice
