// Where a fractal crosses edges.
#include <algorithm>

#include "evaluate.h"

namespace fracslice::slices {
namespace {

constexpr size_t kFew = 128;
constexpr float kSmallest = 1e6f;  // inside values that large bailouts make
constexpr int32_t kOften = 8, kSeldom = 40, kEnough = 96;  // strides of the tiles looked at, and how many are enough

}  // namespace

// Crossed edges of the layer.
std::vector<Slab::Edge> Slab::edges() const {
    std::vector<Edge> result;
    for (int32_t t = kTiles; t < int32_t(count()); ++t)
        crossed(t, kAll, [&](int number, float first, float second) { result.push_back({t, number, first, second}); });
    return result;
}

// Those of one tile in `step`.
Slab::Middles Slab::middles(int32_t step) const {
    Middles result;
    for (auto* list : {&result.x, &result.y, &result.quotients}) list->reserve(count() - kTiles);
    const float half[2] = {float(frame_.dx / 2), float(frame_.dy / 2)};
    for (int32_t t = kTiles; t < int32_t(count()); t += step) {
        const float *x = &x_[kTile * (place[t].x - 1)], *y = &y_[kTile * (place[t].y - 1)];
        crossed(t, kAll, [&](int number, float first, float second) {
            const bool up = number >> 6;
            result.x.push_back(x[number & 7] + (up ? 0 : half[0])), result.y.push_back(y[number >> 3 & 7] + (up ? half[1] : 0));
            result.quotients.push_back(std::max(first, second) / -std::min(first, second));
        });
    }
    return result;
}

// How many times smaller inside values are than outside ones: the factor with which as many crossings lie before the middle
// of their edge as do in truth. An eighth of the edges is enough to know it, and a fortieth of many.
float Slab::inside_scale() {
    const int32_t tiles = int32_t(count()) - kTiles;
    int32_t step = std::clamp(tiles / kEnough, kOften, kSeldom);
    Middles some = middles(step);
    while (some.x.size() < kFew && step > 1) some = middles(step /= 2);
    if (some.x.empty()) return 1;
    const float height = float(z_[layer_]);
    ptrdiff_t before = 0;
    auto where = [&](size_t i, float& x, float& y, float& z) { x = some.x[i], y = some.y[i], z = height; };
    evaluate(some.x.size(), where, [&](size_t, float f) { before += f < 0; });
    auto chosen = some.quotients.begin() + std::min(before, ptrdiff_t(some.quotients.size()) - 1);
    std::nth_element(some.quotients.begin(), chosen, some.quotients.end());
    return std::clamp(*chosen, 0.125f, kSmallest);
}

}  // namespace fracslice::slices
