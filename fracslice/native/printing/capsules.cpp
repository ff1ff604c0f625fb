#include "sampled_field.h"

#include <algorithm>
#include <cmath>

namespace fracslice::printing {
namespace {

using volume::kSamples;

constexpr uint8_t kFar = 255;

// The sample one step along an axis, or a row below 0 if it is in no sampled brick.
struct Sample {
    int32_t row;
    int s;
};

Sample stepped(const volume::Layout& layout, Sample from, int axis, int sign) {
    const int shift = 6 - 3 * axis, at = from.s >> shift & 7;
    if (at + sign >= 0 && at + sign < volume::kSide) return {from.row, from.s + sign * (1 << shift)};
    const int32_t* ijk = layout.ijk + 3 * size_t(from.row);
    std::array<int, 3> brick{ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3};
    brick[size_t(axis)] += sign;
    return {layout.at(brick[0], brick[1], brick[2]), from.s - sign * (7 << shift)};
}

}  // namespace

std::vector<uint8_t> bricks_near(std::span<const Place> points, double reach, const std::array<int, 3>& shape) {
    std::vector<uint8_t> near(size_t(shape[0]) * size_t(shape[1]) * size_t(shape[2]));
    for (const auto& [x, y, z] : points) {
        for (int i = int(x - reach) >> 3; i <= int(x + reach) >> 3; ++i)
            for (int j = int(y - reach) >> 3; j <= int(y + reach) >> 3; ++j)
                for (int k = int(z - reach) >> 3; k <= int(z + reach) >> 3; ++k) {
                    near[(size_t(i) * size_t(shape[1]) + size_t(j)) * size_t(shape[2]) + size_t(k)] = 1;
                }
    }
    return near;
}

void lower_squares(std::span<const Line> lines, std::span<const Place> points, std::span<const int32_t> of, double reach,
                   const volume::Layout& layout, float* squares) {
    const double far = reach + 0.5;  // a sample within reach of a capsule is as near to one of its points
    for (size_t m = 0; m < points.size(); ++m) {
        const auto [x, y, z] = points[m];
        const Line& line = lines[size_t(of[m])];
        const double a = line[3], b = line[4], c = line[5], inverse = line[6];
        for (int i = int(std::ceil(x - far)); i <= int(x + far); ++i)
            for (int j = int(std::ceil(y - far)); j <= int(y + far); ++j) {
                const double u = i - line[0], v = j - line[1];
                const double left = far * far - (i - x) * (i - x) - (j - y) * (j - y);
                if (left < 0) continue;
                for (int k = int(std::ceil(z - std::sqrt(left))); k <= int(z + std::sqrt(left)); ++k) {
                    const double w = k - line[2];
                    const double t = std::min(std::max((u * a + v * b + w * c) * inverse, 0.0), 1.0);
                    const double dx = u - t * a, dy = v - t * b, dz = w - t * c;
                    const int32_t row = layout.at(i >> 3, j >> 3, k >> 3);
                    if (row < 0) continue;  // in the half voxel beyond reach
                    float& square = squares[size_t(row) * kSamples + size_t((i & 7) << 6 | (j & 7) << 3 | (k & 7))];
                    square = std::min(square, float(dx * dx + dy * dy + dz * dz));
                }
            }
    }
}

std::vector<uint8_t> steps_to(const volume::Layout& layout, const bool* seeds) {
    const size_t samples = layout.count * kSamples;
    std::vector<uint8_t> steps(samples, kFar);
    std::vector<Sample> queue;
    for (size_t n = 0; n < samples; ++n) {
        if (!seeds[n]) continue;
        steps[n] = 0;
        queue.push_back({int32_t(n / kSamples), int(n % kSamples)});
    }
    auto of = [&](const Sample& sample) -> uint8_t& { return steps[size_t(sample.row) * kSamples + size_t(sample.s)]; };
    for (size_t first = 0; first < queue.size(); ++first) {
        const Sample here = queue[first];
        const int next = of(here) + 1;
        if (next == kFar) continue;
        for (int axis = 0; axis < 3; ++axis) {
            for (int sign : {-1, 1}) {
                const Sample there = stepped(layout, here, axis, sign);
                if (there.row < 0 || of(there) != kFar) continue;
                of(there) = uint8_t(next);
                queue.push_back(there);
            }
        }
    }
    return steps;
}

}  // namespace fracslice::printing
