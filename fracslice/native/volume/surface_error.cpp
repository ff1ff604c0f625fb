#include "extent.h"

#include <tbb/parallel_for.h>

#include <cmath>

namespace fracslice::volume {
namespace {

// |f| in voxels above which a difference of one is flat.
constexpr double kFlat = 1e-5;

double norm(const std::array<double, 3>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// Some points and the field there, in rows.
struct Block {
    double p[3][kPointsAtOnce], f[kPointsAtOnce], there[kPointsAtOnce];
    std::array<double, 3> up[kPointsAtOnce];  // slopes along the axes
    double steep[kPointsAtOnce];
    size_t number[kPointsAtOnce];  // of the point in its whole block
    size_t count = 0;

    // Slopes of all points along a step, in `there`.
    void differ(const FieldValues& field, const Differences& by, size_t which) {
        double moved[3][kPointsAtOnce];
        for (size_t k = 0; k < 3; ++k) {
            for (size_t i = 0; i < count; ++i) moved[k][i] = p[k][i] + by.steps[3 * which + k];
        }
        field({moved[0], moved[1], moved[2], there}, count);
        for (size_t i = 0; i < count; ++i) there[i] = std::abs(there[i] - f[i]) / by.length;
    }

    // Keeps the points that are flat.
    void keep_flat(double voxel) {
        size_t kept = 0;
        for (size_t i = 0; i < count; ++i) {
            if (!(std::abs(f[i]) > kFlat * voxel * steep[i])) continue;
            for (auto& row : p) row[kept] = row[i];
            f[kept] = f[i], up[kept] = up[i], steep[kept] = steep[i], number[kept] = number[i];
            ++kept;
        }
        count = kept;
    }

    void measure(double voxel, double* errors) const {
        for (size_t i = 0; i < count; ++i) {
            errors[number[i]] = std::min(std::abs(f[i]) / std::max(steep[i], 1e-30), voxel);
        }
    }
};

void measure(const FieldValues& field, const PlacedPoints& points, const Differences& by, double voxel, size_t first, size_t last,
             double* errors) {
    Block block;
    block.count = last - first;
    for (size_t i = 0; i < block.count; ++i) {
        block.number[i] = first + i;
        for (size_t k = 0; k < 3; ++k) block.p[k][i] = points.at(first + i, k);
    }
    field({block.p[0], block.p[1], block.p[2], block.f}, block.count);
    for (size_t k = 0; k < 3; ++k) {
        block.differ(field, by, k);
        for (size_t i = 0; i < block.count; ++i) block.up[i][k] = block.there[i];
    }
    for (size_t i = 0; i < block.count; ++i) block.steep[i] = norm(block.up[i]);
    block.measure(voxel, errors);
    block.keep_flat(voxel);
    if (!block.count) return;
    for (size_t k = 0; k < 3; ++k) {
        block.differ(field, by, 3 + k);
        for (size_t i = 0; i < block.count; ++i) block.up[i][k] = std::max(block.up[i][k], block.there[i]);
    }
    for (size_t i = 0; i < block.count; ++i) block.steep[i] = norm(block.up[i]);
    block.measure(voxel, errors);
    block.keep_flat(voxel);
    for (size_t k = 6; k < 26 && block.count; ++k) {
        block.differ(field, by, k);
        for (size_t i = 0; i < block.count; ++i) block.steep[i] = std::max(block.steep[i], block.there[i]);
    }
    block.measure(voxel, errors);
}

}  // namespace

void surface_error(const FieldValues& field, const PlacedPoints& points, const Differences& differences, double voxel,
                   std::span<double> errors) {
    const size_t blocks = (errors.size() + kPointsAtOnce - 1) / kPointsAtOnce;
    tbb::parallel_for(size_t(0), blocks, [&](size_t k) {
        const size_t first = k * kPointsAtOnce, last = std::min(errors.size(), first + kPointsAtOnce);
        measure(field, points, differences, voxel, first, last, errors.data());
    });
}

}  // namespace fracslice::volume
