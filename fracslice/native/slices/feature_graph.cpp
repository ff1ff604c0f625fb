#include "layer_runs.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>

#include "../disjoint_sets.h"

namespace fracslice::slices {
namespace {

std::vector<int64_t> numbers(size_t count) {
    std::vector<int64_t> all(count);
    std::iota(all.begin(), all.end(), 0);
    return all;
}

}  // namespace

std::vector<uint8_t> closed_nodes(std::span<const Edge> edges, std::span<const int64_t> later, std::span<const int64_t> layer,
                                  std::span<const bool> free) {
    const size_t count = layer.size();
    const int64_t outside = int64_t(count);
    std::vector<int64_t> parent = numbers(count + 1), order = numbers(count);
    std::stable_sort(order.begin(), order.end(), [&](int64_t a, int64_t b) { return layer[size_t(a)] < layer[size_t(b)]; });
    const DisjointSets<int64_t> sets(parent);
    for (size_t i = 0; i < count; ++i) {
        if (free[i]) sets.unite(int64_t(i), outside);
    }
    std::vector<uint8_t> closed(count);
    for (size_t e = 0, i = 0; i < count;) {
        const int64_t now = layer[size_t(order[i])];
        for (; e < edges.size() && later[e] <= now; ++e) sets.unite(edges[e][0], edges[e][1]);
        for (; i < count && layer[size_t(order[i])] == now; ++i) {
            closed[size_t(order[i])] = sets.root(order[i]) != sets.root(outside);
        }
    }
    return closed;
}

std::vector<uint8_t> held_nodes(std::span<const Edge> edges, std::span<const int64_t> roots, size_t count) {
    std::vector<uint8_t> held(count);
    for (int64_t root : roots) held[size_t(root)] = 1;
    for (const auto& [below, above] : edges) held[size_t(above)] |= held[size_t(below)];
    return held;
}

WeakestCut weakest_cut(std::span<const double> area, std::span<const double> firm, std::span<const Edge> edges,
                       std::span<const int64_t> starts, double foot, double least) {
    const size_t count = area.size();
    std::vector<int64_t> parent = numbers(count), widest(count, -1);
    std::vector<double> largest(area.begin(), area.end()), contact(count);  // of the component above, by its root
    const DisjointSets<int64_t> sets(parent);
    auto root_of = [&](int64_t node) { return size_t(sets.root(node)); };
    double ratio = 0;
    WeakestCut weakest;
    for (int64_t cut = int64_t(starts.size()) - 2; cut >= 0; --cut) {
        const auto here = edges.subspan(size_t(starts[size_t(cut)]), size_t(starts[size_t(cut) + 1] - starts[size_t(cut)]));
        std::set<std::pair<int64_t, size_t>> seen;
        for (const auto& [node, above] : here) {
            const size_t root = root_of(above);
            if (!seen.insert({node, root}).second) continue;  // a node may touch a component several times
            contact[root] += firm[size_t(node)];
            if (widest[root] < 0 || firm[size_t(node)] > firm[size_t(widest[root])]) widest[root] = node;
        }
        for (const auto& [node, above] : here) {
            const size_t root = root_of(above);
            if (contact[root] == 0 || largest[root] < (cut ? least : foot) || largest[root] < ratio * contact[root]) continue;
            ratio = largest[root] / contact[root];
            weakest = {contact[root], largest[root], cut, widest[root]};
        }
        for (const auto& [node, above] : here) contact[root_of(above)] = 0, widest[root_of(above)] = -1;
        for (const auto& [node, above] : here) {
            const size_t a = root_of(node), b = root_of(above);
            largest[std::min(a, b)] = std::max(largest[a], largest[b]);
            sets.unite(node, above);
        }
    }
    return weakest;
}

Image<float> spans(const ImageView<bool>& solid, const ImageView<bool>& held, int dy, int dx) {
    Image<float> span(solid.height, solid.width);
    for (int sign : {1, -1}) {
        Image<float> steps(solid.height, solid.width, std::numeric_limits<float>::infinity());
        for (int j = 0; j < solid.height; ++j) {
            const int y = sign > 0 ? j : solid.height - 1 - j, v = y - sign * dy;
            for (int i = 0; i < solid.width; ++i) {
                const int x = sign * (dx ? dx : dy) > 0 ? i : solid.width - 1 - i, u = x - sign * dx;
                if (held[y][x]) {
                    steps[y][x] = 0;
                } else if (solid[y][x] && v >= 0 && v < solid.height && u >= 0 && u < solid.width) {
                    steps[y][x] = steps[v][u] + 1;
                }
                span[y][x] += steps[y][x];
            }
        }
    }
    return span;
}

Image<uint8_t> connected_to(const ImageView<bool>& solid, const ImageView<bool>& held) {
    Image<uint8_t> found(solid.height, solid.width);
    std::vector<std::array<int, 2>> queue;
    auto reach = [&](int y, int x) {
        if (found[y][x]) return;
        found[y][x] = 1;
        queue.push_back({y, x});
    };
    for (int y = 0; y < solid.height; ++y) {
        for (int x = 0; x < solid.width; ++x) {
            if (held[y][x]) reach(y, x);
        }
    }
    while (!queue.empty()) {
        const auto [y, x] = queue.back();
        queue.pop_back();
        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, solid.height - 1); ++v) {
            for (int u = std::max(x - 1, 0); u <= std::min(x + 1, solid.width - 1); ++u) {
                if (solid[v][u]) reach(v, u);
            }
        }
    }
    return found;
}

}  // namespace fracslice::slices
