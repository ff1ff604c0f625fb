// Where a fractal crosses edges.
#include <algorithm>

#include "evaluate.h"

namespace fracslice {
namespace {

constexpr size_t kFew = 128;
constexpr int32_t kEvery = 8;

}  // namespace

// Crossed edges of the layer: of all tiles, or of one in eight.
std::vector<Slab::Edge> Slab::edges(bool all) const {
    std::vector<Edge> found;
    for (int32_t t = first_; t < int32_t(count()); t += all ? 1 : kEvery)
        crossed(t, kAll, [&](int number, float first, float second) { found.push_back({t, number, first, second}); });
    return found;
}

// How many times smaller inside values are than outside ones: the factor with which as many crossings lie before the middle
// of their edge as do in truth. An eighth of the edges is enough to know it.
float Slab::inside_scale(int layer) {
    std::vector<Edge> some = edges(false);
    if (some.size() < kFew) some = edges(true);
    if (some.empty()) return 1;
    std::vector<Spot> spots;
    for (const Edge& e : some) {
        const Place& p = place[e.tile];
        double up = e.number >> 6;
        spots.push_back({kTile * (p.x - 1) + (e.number & 7) + 0.5 * (1 - up),
                         kTile * (p.y - 1) + (e.number >> 3 & 7) + 0.5 * up});
    }
    std::vector<float> middles = values_at(layer, spots), quotients;
    for (const Edge& e : some) quotients.push_back(std::max(e.first, e.second) / -std::min(e.first, e.second));
    auto before = std::count_if(middles.begin(), middles.end(), [](float f) { return f < 0; });
    auto chosen = quotients.begin() + std::min<ptrdiff_t>(before, ptrdiff_t(some.size()) - 1);
    std::nth_element(quotients.begin(), chosen, quotients.end());
    return std::clamp(*chosen, 0.125f, 64.f);
}

}  // namespace fracslice
