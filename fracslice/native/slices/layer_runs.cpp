#include "layer_runs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "../disjoint_sets.h"

namespace fracslice::slices {
namespace {

// Calls act(a, b) for runs of row y of one layer and row v of another that overlap, or at `reach` 1 touch.
template <class Do>
void touching(const LayerRuns& some, int y, const LayerRuns& others, int v, int reach, const Do& act) {
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
bool lies_on(const LayerRuns& below, const LayerRuns& above, int y) {
    int32_t a = below.rows[y];
    for (int32_t b = above.rows[y]; b < above.rows[y + 1]; ++b) {
        while (a < below.rows[y + 1] && below.end[a] < above.end[b]) ++a;
        if (a == below.rows[y + 1] || below.begin[a] > above.begin[b]) return false;
    }
    return true;
}

}  // namespace

OwnedRuns gaps(const LayerRuns& runs) {
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

RunComponents components(const LayerRuns& runs, int reach) {
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

std::vector<std::array<int64_t, 2>> overlaps(const LayerRuns& below, std::span<const int64_t> labels_below, const LayerRuns& above,
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

OwnedRuns unsupported(const LayerRuns& below, const LayerRuns& above, double reach) {
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

namespace {

// Nearest pixels of a row to the columns of another, of which each column has one at a height above or below it: the part of the
// Voronoi diagram that the row cuts (Maurer, Qi and Raghavan 2003, "A linear time algorithm for computing exact Euclidean distance
// transforms of binary images in arbitrary dimensions").
class VoronoiRow {
  public:
    explicit VoronoiRow(double width) : width_(width) {}

    void clear() { sites_.clear(); }

    // A site in a column farther to the right.
    void add(int column, double square) {
        while (sites_.size() > 1 && is_hidden(sites_[sites_.size() - 2], sites_.back(), {column, square})) sites_.pop_back();
        sites_.push_back({column, square});
    }

    // Least squared distance of each column to a site.
    void squares(int columns, double* to) const {
        size_t k = 0;
        for (int x = 0; x < columns; ++x) {
            double least = square(sites_[k], x);
            for (double next; k + 1 < sites_.size() && (next = square(sites_[k + 1], x)) < least; ++k) least = next;
            to[x] = least;
        }
    }

  private:
    struct Site {
        int column;
        double square;  // squared distance to the row
    };

    // Whether the site between two others is nowhere in the row the nearest.
    bool is_hidden(const Site& left, const Site& between, const Site& right) const {
        const double a = double(between.column - left.column) * width_, b = double(right.column - between.column) * width_, c = a + b;
        return c * between.square - b * left.square - a * right.square - a * b * c > 0;
    }
    double square(const Site& site, int x) const {
        const double across = double(site.column - x) * width_;
        return site.square + across * across;
    }

    double width_;
    std::vector<Site> sites_;
};

// Of each pixel the row of the nearest one in its column that is not of the region, the upper of two; -1 if there is none.
Image<int32_t> nearest_rows(const ImageView<bool>& region) {
    Image<int32_t> rows(region.height, region.width, -1);
    for (int y = 0; y < region.height; ++y) {
        for (int x = 0; x < region.width; ++x) rows[y][x] = !region[y][x] ? y : y ? rows[y - 1][x] : -1;
    }
    for (int y = region.height - 2; y >= 0; --y) {
        for (int x = 0; x < region.width; ++x) {
            const int32_t before = rows[y][x], behind = rows[y + 1][x];
            if (behind > y && (before < 0 || behind - y < y - before)) rows[y][x] = behind;
        }
    }
    return rows;
}

}  // namespace

Image<int32_t> count_pixels(const LayerRuns& runs, int times) {
    Image<int32_t> count((runs.height() + times - 1) / times, (runs.width + times - 1) / times);
    for (int y = 0; y < runs.height(); ++y) {
        int32_t* line = count[y / times];
        for (int32_t r = runs.rows[y]; r < runs.rows[y + 1]; ++r) {
            const int first = runs.begin[r] / times, last = (runs.end[r] - 1) / times;
            for (int x = first; x <= last; ++x) line[x] += times;
            line[first] -= runs.begin[r] - first * times;
            line[last] -= (last + 1) * times - runs.end[r];
        }
    }
    return count;
}

Image<uint8_t> narrow_pixels(const LayerRuns& runs, bool gaps, int times, const std::array<int64_t, 2>& longest) {
    const int width = runs.width;
    Image<uint8_t> narrow((runs.height() + times - 1) / times, (width + times - 1) / times);
    std::vector<int64_t> since(size_t(width), -longest[1] - 1);  // row of the last change in each column
    for (int y = 0; y < runs.height(); ++y) {
        const int32_t first = runs.rows[y], last = runs.rows[y + 1];
        for (int32_t r = first; r < last - gaps; ++r) {
            const int low = gaps ? runs.end[r] : runs.begin[r], high = gaps ? runs.begin[r + 1] : runs.end[r];
            if (high - low > longest[0]) continue;
            std::fill(narrow[y / times] + low / times, narrow[y / times] + (high - 1) / times + 1, uint8_t(1));
        }
        // Columns that change between the row below and this one, by the ends of the runs of both.
        int32_t a = y ? runs.rows[y - 1] : first, b = first;
        bool at_a = false, at_b = false, changed = false;
        for (int x = 0;;) {
            const int to_a = a == first || y == 0 ? width : at_a ? runs.end[a] : runs.begin[a];
            const int to_b = b == last ? width : at_b ? runs.end[b] : runs.begin[b];
            const int to = std::min(to_a, to_b);
            for (int column = x; changed && column < to; ++column) {
                if (at_b == gaps && y - since[size_t(column)] <= longest[1]) {
                    for (int64_t v = since[size_t(column)] / times; v <= (y - 1) / times; ++v) narrow[int(v)][column / times] = 1;
                }
                since[size_t(column)] = y;
            }
            if (to == width) break;
            if (to_a == to) a += at_a, at_a = !at_a;
            if (to_b == to) b += at_b, at_b = !at_b;
            x = to, changed = at_a != at_b;
        }
    }
    return narrow;
}

Image<uint8_t> painted(const LayerRuns& runs, int top, int left, int height, int width) {
    Image<uint8_t> image(height, width);
    for (int y = std::max(-top, 0); y < std::min(height, runs.height() - top); ++y) {
        for (int32_t r = runs.rows[top + y]; r < runs.rows[top + y + 1]; ++r) {
            const int begin = std::max(runs.begin[r] - left, 0), end = std::min(runs.end[r] - left, width);
            if (begin < end) std::fill(image[y] + begin, image[y] + end, uint8_t(1));
        }
    }
    return image;
}

Image<double> distances(const ImageView<bool>& region, double height, double width) {
    const Image<int32_t> rows = nearest_rows(region);
    Image<double> result(region.height, region.width, std::numeric_limits<double>::infinity());
    VoronoiRow sites(width);
    for (int y = 0; y < region.height; ++y) {
        sites.clear();
        bool some = false;
        for (int x = 0; x < region.width; ++x) {
            if (rows[y][x] < 0) continue;
            const double up = double(rows[y][x] - y) * height;
            sites.add(x, up * up);
            some = true;
        }
        if (!some) continue;
        sites.squares(region.width, result[y]);
        for (int x = 0; x < region.width; ++x) result[y][x] = std::sqrt(result[y][x]);
    }
    return result;
}

Image<uint8_t> dilated(const ImageView<uint8_t>& image, const ImageView<double>& cone) {
    Image<uint8_t> out(image.height, image.width);
    std::copy_n(image.pixels, out.pixels.size(), out.pixels.begin());
    const int reach = cone.height / 2;
    auto is_deep = [&](int y, int x) {  // full pixels all around: those beside it reach as far
        if (y == 0 || x == 0 || y == image.height - 1 || x == image.width - 1) return false;
        for (int v = y - 1; v <= y + 1; ++v) {
            if (std::any_of(image[v] + x - 1, image[v] + x + 2, [](uint8_t a) { return a != 255; })) return false;
        }
        return true;
    };
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            if (image[y][x] == 0 || is_deep(y, x)) continue;
            for (int v = std::max(y - reach, 0); v < std::min(y + reach + 1, image.height); ++v) {
                for (int u = std::max(x - reach, 0); u < std::min(x + reach + 1, image.width); ++u) {
                    const double grown = std::min(image[y][x] + cone[v - y + reach][u - x + reach], 255.0);
                    if (grown > out[v][u]) out[v][u] = uint8_t(grown + 0.5);
                }
            }
        }
    }
    return out;
}

}  // namespace fracslice::slices
