// Where a fractal crosses edges.
#include <algorithm>

#include "evaluate.h"

namespace fracslice {
namespace {

constexpr size_t kFew = 128;
constexpr int32_t kEvery = 8;

}  // namespace

// Crossed edges of the layer.
std::vector<Slab::Edge> Slab::edges() const {
    std::vector<Edge> found;
    for (int32_t t = first_; t < int32_t(count()); ++t)
        crossed(t, kAll, [&](int number, float first, float second) { found.push_back({t, number, first, second}); });
    return found;
}

// Those of one tile in `step`.
std::vector<Slab::Middle> Slab::middles(int32_t step) const {
    std::vector<Middle> found;
    const float half[2] = {float(frame_.dx / 2), float(frame_.dy / 2)};
    found.reserve(count() - first_);
    for (int32_t t = first_; t < int32_t(count()); t += step) {
        const float *x = &x_[kTile * (place[t].x - 1)], *y = &y_[kTile * (place[t].y - 1)];
        crossed(t, kAll, [&](int number, float first, float second) {
            const bool up = number >> 6;
            found.push_back({x[number & 7] + (up ? 0 : half[0]), y[number >> 3 & 7] + (up ? half[1] : 0),
                             first < 0 ? second / -first : first / -second});
        });
    }
    return found;
}

// How many times smaller inside values are than outside ones: the factor with which as many crossings lie before the middle
// of their edge as do in truth. An eighth of the edges is enough to know it.
float Slab::inside_scale(int layer) {
    std::vector<Middle> some = middles(kEvery);
    if (some.size() < kFew) some = middles(1);
    if (some.empty()) return 1;
    const float height = float(z_[layer]);
    ptrdiff_t before = 0;
    auto where = [&](size_t i, float& x, float& y, float& z) { x = some[i].x, y = some[i].y, z = height; };
    evaluate(some.size(), where, [&](size_t, float f) { before += f < 0; });
    auto chosen = some.begin() + std::min(before, ptrdiff_t(some.size()) - 1);
    std::nth_element(some.begin(), chosen, some.end(), [](const Middle& a, const Middle& b) { return a.quotient < b.quotient; });
    return std::clamp(chosen->quotient, 0.125f, 64.f);
}

}  // namespace fracslice
