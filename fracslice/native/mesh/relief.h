// Heights on a grid in the plane as machine code asks for them: bilinear between samples.
#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "distances.h"

namespace fracslice::mesh {

// Beyond the grid heights go on as at its borders; those that wrap begin again in the column after the last one.
class Relief {
  public:
    static constexpr size_t kAxes = 2;

    // Heights [rows, columns], row by row, `across` and `up` apart, with the middle of the grid at the origin.
    Relief(std::span<const double> heights, size_t columns, double across, double up, bool wraps)
        : heights_(heights.begin(), heights.end()), columns_(columns), rows_(heights.size() / columns), across_(across), up_(up),
          wraps_(wraps), entry_(entry_of(this)) {}
    Relief(const Relief&) = delete;
    Relief& operator=(const Relief&) = delete;

    const Distances* entry() const { return &entry_; }

    double operator()(const double* p, size_t&) const {
        if (!std::isfinite(p[0] + p[1])) return std::abs(p[0]) + std::abs(p[1]);
        const double columns = double(columns_);
        double u = p[0] / across_ + (wraps_ ? columns : columns - 1) / 2;
        u = wraps_ ? u - columns * std::floor(u / columns) : std::clamp(u, 0.0, columns - 1);
        const double v = std::clamp(p[1] / up_ + double(rows_ - 1) / 2, 0.0, double(rows_ - 1));
        const size_t i = std::min(size_t(u), columns_ - 1), j = std::min(size_t(v), rows_ - 1);
        const size_t right = i + 1 < columns_ ? i + 1 : wraps_ ? 0 : i, above = std::min(j + 1, rows_ - 1);
        const double s = u - double(i), t = v - double(j);
        const auto row = [&](size_t k) { return (1 - s) * heights_[k * columns_ + i] + s * heights_[k * columns_ + right]; };
        return (1 - t) * row(j) + t * row(above);
    }

  private:
    std::vector<double> heights_;
    size_t columns_, rows_;
    double across_, up_;
    bool wraps_;
    Distances entry_;
};

}  // namespace fracslice::mesh
