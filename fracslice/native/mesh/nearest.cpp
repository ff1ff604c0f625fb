#include "nearest.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>

#include "corner_table.h"

namespace fracslice::mesh {
namespace {

// Triangles that one thread looks at in turn, each beginning where the one before was: always the same ones.
constexpr size_t kTurn = 256;
// Points that share a search, and the most triangles that it may find.
constexpr size_t kRun = 64, kMost = 48;
// The longest way over neighbouring triangles.
constexpr int kSteps = 32;

template <class Do>
void in_turns(size_t count, const Do& act) {
    tbb::parallel_for(size_t(0), (count + kTurn - 1) / kTurn,
                      [&](size_t turn) { act(turn * kTurn, std::min(count, (turn + 1) * kTurn)); });
}

// The square of how far a number is from an interval.
double outside(double x, double low, double high) {
    double d = std::max(std::max(low - x, 0.0), x - high);
    return d * d;
}

}  // namespace

Nearest::Nearest(const MeshView& mesh, const TreeView& tree, bool closed) : mesh_(mesh), tree_(tree) {
    if (closed) across_ = opposite_corners(mesh);
}

double Nearest::to_box(const double* p, size_t node) const {
    const double *low = tree_.low + 3 * node, *high = tree_.high + 3 * node;
    double total = 0;
    for (size_t k = 0; k < 3; ++k) total += outside(p[k], low[k], high[k]);
    return total;
}

double Nearest::to_box_of_triangle(const double* p, size_t t) const {
    const double *a = mesh_.corner(t, 0), *b = mesh_.corner(t, 1), *c = mesh_.corner(t, 2);
    double total = 0;
    for (size_t k = 0; k < 3; ++k) total += outside(p[k], std::min(std::min(a[k], b[k]), c[k]), std::max(std::max(a[k], b[k]), c[k]));
    return total;
}

Neighbour Nearest::operator()(const double* p, size_t guess) const {
    struct Open {
        size_t node;
        double square;
    } open[128];
    Neighbour best{guess, distance(guess).square(p)};
    open[0] = {1, 0};
    for (int height = 1; height > 0;) {
        auto [node, square] = open[--height];
        if (square >= best.square) continue;
        if (node >= tree_.leaves) {
            size_t leaf = node - tree_.leaves;
            for (size_t i = tree_.first(leaf); i < tree_.last(leaf); ++i) {
                size_t t = size_t(tree_.order[i]);
                if (to_box_of_triangle(p, t) >= best.square) continue;
                if (double d = distance(t).square(p); d < best.square) best = {t, d};
            }
            continue;
        }
        Open one{2 * node, to_box(p, 2 * node)}, two{2 * node + 1, to_box(p, 2 * node + 1)};
        if (one.square < two.square) std::swap(one, two);
        open[height++] = one, open[height++] = two;
    }
    return best;
}

// From neighbour to neighbour as long as that comes nearer: mostly all the way.
Neighbour Nearest::within(double limit, const double* p, size_t guess) const {
    Neighbour best{guess, distance(guess).square(p)};
    bool nearer = !across_.empty();
    for (int step = 0; nearer && step < kSteps; ++step) {
        nearer = false;
        for (size_t c = 3 * best.triangle, end = c + 3; c < end; ++c) {
            size_t t = size_t(across_[c]) / 3;
            if (double d = distance(t).square(p); d < best.square) best = {t, d}, nearer = true;
        }
    }
    return best.square <= limit ? best : (*this)(p, best.triangle);
}

std::vector<Nearest::Pair> Nearest::bounds(const MeshView& triangles, std::span<const int32_t> hints, double tolerance, double* distances) const {
    std::vector<std::vector<Pair>> beyond((triangles.count + kTurn - 1) / kTurn);
    in_turns(triangles.count, [&](size_t first, size_t last) {
        Bound<Nearest> bound(*this, tolerance);
        size_t near[3] = {0, 0, 0};
        for (size_t t = first; t < last; ++t) {
            if (!hints.empty()) std::copy_n(&hints[3 * t], 3, near);
            distances[t] = std::sqrt(bound({triangles.corner(t, 0), triangles.corner(t, 1), triangles.corner(t, 2)}, near));
            for (size_t other : bound.beyond()) beyond[first / kTurn].push_back({int32_t(t), int32_t(other)});
        }
    });
    std::vector<Pair> pairs;
    for (const auto& turn : beyond) pairs.insert(pairs.end(), turn.begin(), turn.end());
    return pairs;
}

void Nearest::points(std::span<const double> points, double* distances) const {
    in_turns(points.size() / 3, [&](size_t first, size_t last) {
        size_t guess = 0;
        for (size_t i = first; i < last; i += kRun) {
            run(points.subspan(3 * i, 3 * std::min(kRun, last - i)), guess, distances + i);
        }
    });
}

// The triangle nearest to a point of a ball is at most the ball's diameter farther from the centre than the one nearest to the
// centre.
void Nearest::run(std::span<const double> points, size_t& guess, double* distances) const {
    const size_t count = points.size() / 3;
    double centre[3], radius = 0;
    for (size_t x = 0; x < 3; ++x) {
        double low = points[x], high = points[x];
        for (size_t i = 1; i < count; ++i) low = std::min(low, points[3 * i + x]), high = std::max(high, points[3 * i + x]);
        centre[x] = (low + high) / 2, radius += (high - low) * (high - low) / 4;
    }
    Neighbour nearest = (*this)(centre, guess);
    guess = nearest.triangle;
    TriangleDistance near[kMost + 1];
    size_t known = around(centre, (std::sqrt(nearest.square) + 2 * std::sqrt(radius)) * (1 + 1e-9), near);
    for (size_t i = 0; i < count; ++i) {
        const double* p = &points[3 * i];
        double best = std::numeric_limits<double>::infinity();
        if (known > kMost) {
            Neighbour one = (*this)(p, guess);
            guess = one.triangle, best = one.square;
        }
        for (size_t t = 0; known <= kMost && t < known; ++t) best = std::min(best, near[t].square(p));
        distances[i] = std::sqrt(best);
    }
}

size_t Nearest::around(const double* p, double reach, TriangleDistance* triangles) const {
    size_t open[128] = {1}, count = 0;
    for (int height = 1; height > 0 && count <= kMost;) {
        size_t node = open[--height];
        if (to_box(p, node) > reach * reach) continue;
        if (node < tree_.leaves) {
            open[height++] = 2 * node, open[height++] = 2 * node + 1;
            continue;
        }
        size_t leaf = node - tree_.leaves;
        for (size_t i = tree_.first(leaf); i < tree_.last(leaf) && count <= kMost; ++i) {
            triangles[count] = distance(size_t(tree_.order[i]));
            count += triangles[count].square(p) <= reach * reach;
        }
    }
    return count;
}

void Nearest::samples(const MeshView& triangles, double spacing, double enough, double* distances) const {
    in_turns(triangles.count, [&](size_t first, size_t last) {
        size_t guess = 0;
        for (size_t t = first; t < last; ++t) distances[t] = sampled(triangles, t, spacing, enough * enough, guess);
    });
}

double Nearest::sampled(const MeshView& triangles, size_t t, double spacing, double limit, size_t& guess) const {
    const double *a = triangles.corner(t, 0), *b = triangles.corner(t, 1), *c = triangles.corner(t, 2);
    double longest = 0, most = 0;
    for (int x = 0; x < 3; ++x) {
        double d = std::max({std::abs(a[x] - b[x]), std::abs(b[x] - c[x]), std::abs(c[x] - a[x])});
        longest += d * d;
    }
    int n = std::max(1, int(std::ceil(std::sqrt(longest) / spacing)));
    for (int i = 0; i <= n; ++i) {
        size_t begin = guess;
        for (int j = 0; j <= n - i; ++j) {
            double p[3];
            for (int x = 0; x < 3; ++x) p[x] = a[x] + (b[x] - a[x]) * i / n + (c[x] - a[x]) * j / n;
            Neighbour neighbour = within(limit, p, guess);
            guess = neighbour.triangle;
            if (j == 0) begin = guess;
            most = std::max(most, neighbour.square);
        }
        guess = begin;
    }
    return std::sqrt(most);
}

}  // namespace fracslice::mesh
