#include "climb.h"

#include <tbb/parallel_for.h>

#include <numeric>

namespace fracslice::volume {
namespace {

constexpr int kRounds = 256;  // at most
constexpr size_t kBlock = 2 * kPointsAtOnce;

void evaluate(const FieldValues& field, Points& points) {
    const size_t n = points.size();
    points.f.resize(n);
    tbb::parallel_for(size_t(0), (n + kBlock - 1) / kBlock, [&](size_t k) {
        const size_t i = k * kBlock;
        field({&points.x[i], &points.y[i], &points.z[i], &points.f[i]}, std::min(kBlock, n - i));
    });
}

}  // namespace

void climb(const FieldValues& field, const std::array<double*, 3>& points, size_t directions, size_t starts, const Steps& steps,
           double first, double exact) {
    std::vector<double> step(directions, first);
    std::vector<size_t> going(directions);
    std::iota(going.begin(), going.end(), size_t(0));
    Points tried;
    for (int round = 0; round < kRounds && !going.empty() && starts; ++round) {
        tried.clear();
        for (size_t d : going) {
            const size_t first_step = d * steps.count;
            for (size_t i = d * starts; i < (d + 1) * starts; ++i) {
                for (size_t w = first_step; w < first_step + steps.count; ++w) {
                    tried.push({points[0][i] + step[d] * steps.x[w], points[1][i] + step[d] * steps.y[w],
                                points[2][i] + step[d] * steps.z[w]});
                }
            }
        }
        evaluate(field, tried);
        std::vector<size_t> left;
        size_t here = 0;
        for (size_t d : going) {
            bool moved = false;
            for (size_t i = d * starts; i < (d + 1) * starts; ++i, here += steps.count) {
                size_t best = 0;
                double gain = 0;
                for (size_t w = 0; w < steps.count; ++w) {
                    if (tried.f[here + w] < 0 && steps.gain[w] > gain) best = w, gain = steps.gain[w];
                }
                if (gain > 0) {
                    const auto to = tried[here + best];
                    for (size_t k = 0; k < 3; ++k) points[k][i] = to[k];
                    moved = true;
                }
            }
            if (moved || !(step[d] < exact)) left.push_back(d);
            if (!moved) step[d] /= 2;
        }
        going = std::move(left);
    }
}

}  // namespace fracslice::volume
