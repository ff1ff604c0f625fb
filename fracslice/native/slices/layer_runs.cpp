#include "layer_runs.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "../disjoint_sets.h"

namespace fracslice::slices {
namespace {

// Calls act(a, b) for runs of row y of one layer and row v of another that overlap, or at `reach` 1 touch.
template <class Do>
void touching(const Runs& some, int y, const Runs& others, int v, int reach, const Do& act) {
    int32_t a = some.rows[y], b = others.rows[v];
    while (a < some.rows[y + 1] && b < others.rows[v + 1]) {
        if (some.begin[a] < others.end[b] + reach && others.begin[b] < some.end[a] + reach) act(a, b);
        if (some.end[a] < others.end[b]) {
            ++a;
        } else {
            ++b;
        }
    }
}

// Whether every run of a row lies on a run of the row below.
bool lies_on(const Runs& below, const Runs& above, int y) {
    int32_t a = below.rows[y];
    for (int32_t b = above.rows[y]; b < above.rows[y + 1]; ++b) {
        while (a < below.rows[y + 1] && below.end[a] < above.end[b]) ++a;
        if (a == below.rows[y + 1] || below.begin[a] > above.begin[b]) return false;
    }
    return true;
}

}  // namespace

OwnedRuns gaps(const Runs& runs) {
    OwnedRuns result;
    for (int y = 0; y < runs.height(); ++y) {
        int x = 0;
        for (int32_t r = runs.rows[y]; r < runs.rows[y + 1]; ++r) {
            if (runs.begin[r] > x) result.add(x, runs.begin[r]);
            x = runs.end[r];
        }
        if (x < runs.width) result.add(x, runs.width);
        result.end_row();
    }
    return result;
}

RunComponents components(const Runs& runs, int reach) {
    RunComponents result;
    result.label.resize(runs.begin.size());
    std::iota(result.label.begin(), result.label.end(), 0);
    DisjointSets<int64_t> sets(result.label);
    for (int y = 0; y + 1 < runs.height(); ++y) {
        touching(runs, y, runs, y + 1, reach, [&](int32_t a, int32_t b) { sets.unite(a, b); });
    }
    const size_t count = size_t(sets.number());
    result.area.resize(count);
    result.middle.resize(count);
    result.open.resize(count);
    for (int y = 0; y < runs.height(); ++y) {
        for (int32_t r = runs.rows[y]; r < runs.rows[y + 1]; ++r) {
            const size_t component = size_t(result.label[size_t(r)]);
            const int begin = runs.begin[r], end = runs.end[r];
            result.area[component] += end - begin;
            result.middle[component][0] += (end - begin) * ((double(begin) + end) / 2);
            result.middle[component][1] += (end - begin) * (y + 0.5);
            if (begin == 0 || end == runs.width || y == 0 || y == runs.height() - 1) result.open[component] = 1;
        }
    }
    for (size_t c = 0; c < count; ++c) {
        for (double& at : result.middle[c]) at /= double(std::max(result.area[c], int64_t(1)));
    }
    return result;
}

std::vector<std::array<int64_t, 2>> overlaps(const Runs& below, std::span<const int64_t> labels_below, const Runs& above,
                                             std::span<const int64_t> labels_above) {
    std::vector<std::array<int64_t, 2>> pairs;
    for (int y = 0; y < below.height(); ++y) {
        touching(below, y, above, y, 0, [&](int32_t a, int32_t b) {
            const std::array<int64_t, 2> pair{labels_below[a], labels_above[b]};
            if (pairs.empty() || pairs.back() != pair) pairs.push_back(pair);  // most follow each other
        });
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

OwnedRuns unsupported(const Runs& below, const Runs& above, double reach) {
    OwnedRuns result;
    std::vector<int32_t> held(size_t(above.width) + 1);  // where runs of the layer below, with their reach, begin less where they end
    const int far = int(std::floor(reach));
    for (int y = 0; y < above.height(); ++y) {
        if (!lies_on(below, above, y)) {
            std::fill(held.begin(), held.end(), 0);
            for (int v = std::max(y - far, 0); v <= std::min(y + far, below.height() - 1); ++v) {
                const int side = int(std::floor(std::sqrt(reach * reach - double(v - y) * (v - y))));
                for (int32_t r = below.rows[v]; r < below.rows[v + 1]; ++r) {
                    ++held[size_t(std::max(below.begin[r] - side, 0))];
                    --held[size_t(std::min(below.end[r] + side, above.width))];
                }
            }
            int level = 0, x = 0;
            for (int32_t r = above.rows[y]; r < above.rows[y + 1]; ++r) {
                while (x < above.begin[r]) level += held[size_t(x++)];
                int since = -1;
                for (; x < above.end[r]; ++x) {
                    level += held[size_t(x)];
                    if (level == 0 && since < 0) since = x;
                    if (level != 0 && since >= 0) {
                        result.add(since, x);
                        since = -1;
                    }
                }
                if (since >= 0) result.add(since, x);
            }
        }
        result.end_row();
    }
    return result;
}

}  // namespace fracslice::slices
