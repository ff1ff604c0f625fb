#include "nearest.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>
#include <memory>

#include "topology.h"

namespace fracslice::mesh {
namespace {

// Triangles that one thread looks at in turn, each beginning where the one before was: always the same ones.
constexpr size_t kTurn = 256;
// Points that share a search, those that share a part of what it finds, and the most leaves that it may find.
constexpr size_t kRun = 64, kGroup = 8, kMost = 512;
// The most triangles that a run or a group compares one by one.
constexpr size_t kFew = 8;
// The least length of the normal of a triangle that is no sliver, by the squares of its sides.
constexpr double kSliver = 1e-4;
// Points that are sorted in space, and cells along each side of their box.
constexpr size_t kSorted = 512, kCells = 8;
// The longest way over neighbouring triangles.
constexpr int kSteps = 32;

template <class Do>
void in_turns(size_t count, const Do& act) {
    tbb::parallel_for(size_t(0), (count + kTurn - 1) / kTurn,
                      [&](size_t turn) { act(turn * kTurn, std::min(count, (turn + 1) * kTurn)); });
}

// The square of how far a number is from an interval.
template <class T>
T outside(T x, T low, T high) {
    T d = std::max(std::max(low - x, T(0)), x - high);
    return d * d;
}

// A number, or 0 if it is negative, without a branch.
float positive(float x) { return (x + std::abs(x)) / 2; }

// Boxes are kept as floats: larger by more than the rounding of coordinates, which are at most `scale`, and of points up to
// twice as far. Squares of distances are compared after a factor that covers their own rounding, and that of other points.
constexpr double kLarger = 1e-6;
constexpr float kSure = 1 - 2e-6f, kUnsure = 4e-6f;
// Times the largest coordinate, from where on they cover whole meshes.
constexpr double kRemote = 256;
// From where on a mesh is a point: its triangles are equally far.
constexpr double kPoint = 1e11;

// A point as floats.
struct Rounded {
    float x[3];

    explicit Rounded(const double* p) : x{float(p[0]), float(p[1]), float(p[2])} {}
};

// Numbers below kCells with two zeros behind each bit.
constexpr uint16_t kSpread[kCells] = {0, 1, 8, 9, 64, 65, 72, 73};

// Sorts up to kSorted points [n, 3] by the cells of their box in Morton order: of a brick, 64 and 8 consecutive ones are cubes.
void sort(const double* points, size_t count, uint16_t* order) {
    uint16_t cells[kSorted] = {}, starts[kCells * kCells * kCells + 1] = {};
    for (size_t k = 0; k < 3; ++k) {
        double low = points[k], high = low;
        for (size_t i = 1; i < count; ++i) low = std::min(low, points[3 * i + k]), high = std::max(high, points[3 * i + k]);
        const double side = high > low ? high - low : 1;
        for (size_t i = 0; i < count; ++i) {
            const size_t cell = size_t((points[3 * i + k] - low) / side * (double(kCells) - 0.001));
            cells[i] |= uint16_t(kSpread[cell] << (2 - k));
        }
    }
    for (size_t i = 0; i < count; ++i) ++starts[cells[i] + 1];
    for (size_t cell = 1; cell < std::size(starts); ++cell) starts[cell] = uint16_t(starts[cell] + starts[cell - 1]);
    for (size_t i = 0; i < count; ++i) order[starts[cells[i]]++] = uint16_t(i);
}

// Around points [n, 3].
struct Ball {
    double centre[3], radius = 0;

    explicit Ball(std::span<const double> points) {
        for (size_t x = 0; x < 3; ++x) {
            double low = points[x], high = points[x];
            for (size_t i = x; i < points.size(); i += 3) low = std::min(low, points[i]), high = std::max(high, points[i]);
            centre[x] = (low + high) / 2, radius += (high - low) * (high - low) / 4;
        }
        radius = std::sqrt(radius);
    }
    // The triangle nearest to one of its points is at most its diameter farther from the centre than the one nearest to the
    // centre: the square of that distance.
    double reach(double nearest) const {
        double reach = (std::sqrt(nearest) + 2 * radius) * (1 + 1e-9);
        return reach * reach;
    }
};

}  // namespace

template <size_t kCount>
void Nearest::Boxes<kCount>::set(size_t i, const double* lowest, const double* highest, double more) {
    for (size_t k = 0; k < 3; ++k) low[k][i] = float(lowest[k] - more), high[k][i] = float(highest[k] + more);
}

// The squares of the distances of the first boxes.
template <size_t kCount>
void Nearest::Boxes<kCount>::squares(const float* p, size_t count, float* out) const {
    for (size_t i = 0; i < count; ++i) {
        out[i] = (outside(p[0], low[0][i], high[0][i]) + outside(p[1], low[1][i], high[1][i]) + outside(p[2], low[2][i], high[2][i])) * kSure;
    }
}

void Nearest::Circles::set(size_t i, const MeshView& mesh, size_t t, double more) {
    double middle[3], along[3], square = 0;
    for (size_t k = 0; k < 3; ++k) middle[k] = (mesh.corner(t, 0)[k] + mesh.corner(t, 1)[k] + mesh.corner(t, 2)[k]) / 3;
    for (int corner = 0; corner < 3; ++corner) {
        double d = 0;
        for (size_t k = 0; k < 3; ++k) d += (mesh.corner(t, corner)[k] - middle[k]) * (mesh.corner(t, corner)[k] - middle[k]);
        square = std::max(square, d);
    }
    TriangleDistance(mesh, t).normal(along);
    const double length = std::sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
    for (size_t k = 0; k < 3; ++k) centre[k][i] = float(middle[k]), normal[k][i] = length > 0 ? float(along[k] / length) : 0;
    radius[i] = float(std::sqrt(square) + more);
}

// Squares of what the distances of the triangles are at least: of their planes, and beside the circles in them.
void Nearest::Circles::squares(const float* p, float more, float* out) const {
    float whole[kLeaf], up[kLeaf], beside[kLeaf];  // squares of distances from centres, heights above planes
    for (size_t i = 0; i < kLeaf; ++i) {
        const float x = p[0] - centre[0][i], y = p[1] - centre[1][i], z = p[2] - centre[2][i];
        whole[i] = x * x + y * y + z * z, up[i] = std::abs(x * normal[0][i] + y * normal[1][i] + z * normal[2][i]);
    }
    for (size_t i = 0; i < kLeaf; ++i) beside[i] = std::sqrt(whole[i] * (1 + kUnsure) - up[i] * up[i]) - radius[i];
    for (size_t i = 0; i < kLeaf; ++i) {
        const float above = positive(up[i] - more), away = positive(beside[i]);
        out[i] = above * above + away * away - 3 * kUnsure * whole[i];
    }
}

// Leaves that a search found.
struct Nearest::Found {
    size_t count = 0, leaves[kMost];
    Boxes<kMost> boxes;
};

// A triangle, with what many points ask of it.
struct Candidate {
    size_t triangle = 0;
    TriangleDistance distance;
    const double* corner = nullptr;
    double normal[3] = {0, 0, 0};  // of unit length; 0 of a sliver, which leaves it no digits

    Candidate() = default;
    Candidate(const MeshView& mesh, size_t t) : triangle(t), distance(mesh, t), corner(mesh.corner(t, 0)) {
        distance.normal(normal);
        const double length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        for (double& x : normal) x = length > kSliver * distance.square_sides() ? x / length : 0;
    }
    // The distance of a point from the plane, to the rounding of coordinates.
    double height(const double* p) const {
        return std::abs((p[0] - corner[0]) * normal[0] + (p[1] - corner[1]) * normal[1] + (p[2] - corner[2]) * normal[2]);
    }
};

// Distances of runs of points: leaves in which the nearest triangles of a run may be, of them those of a group.
class Nearest::Run {
  public:
    explicit Run(const Nearest& nearest) : nearest_(nearest) {}

    void operator()(std::span<const double> points, double* distances) {
        Ball ball(points);
        Neighbour nearest = nearest_(ball.centre, guess_);
        guess_ = nearest.triangle;
        const double reach = ball.reach(nearest.square);
        const bool all = nearest_.around(ball.centre, reach, around_);
        if (all && choose(around_, Rounded(ball.centre), reach)) {
            for (size_t i = 0; i < points.size() / 3; ++i) distances[i] = std::sqrt(among(&points[3 * i]).square);
            return;
        }
        for (size_t first = 0, count = points.size() / 3; first < count; first += kGroup) {
            const size_t last = std::min(first + kGroup, count);
            const bool few = all && choose(points.subspan(3 * first, 3 * (last - first)));
            for (size_t i = first; i < last; ++i) {
                const double* p = &points[3 * i];
                Neighbour one = few ? among(p) : all ? among(chosen_, p) : nearest_(p, guess_);
                guess_ = one.triangle, distances[i] = std::sqrt(one.square);
            }
        }
    }

  private:
    // The nearest triangle in leaves that hold all that may be nearest.
    Neighbour among(const Found& found, const double* p) {
        const Rounded rounded(p);
        found.boxes.squares(rounded.x, found.count, squares_);
        Neighbour best{guess_, nearest_.distance(guess_).square(p)};
        for (size_t i = 0; i < found.count; ++i) {
            if (squares_[i] < best.square) nearest_.search<false>(found.leaves[i], p, rounded.x, best);
        }
        return best;
    }

    // The leaves of a group; whether their triangles are few.
    bool choose(std::span<const double> group) {
        Ball ball(group);
        Neighbour nearest = among(around_, ball.centre);
        const double reach = ball.reach(nearest.square);
        guess_ = nearest.triangle;
        chosen_.count = 0;
        for (size_t i = 0; i < around_.count; ++i) {
            if (squares_[i] > reach) continue;
            for (size_t k = 0; k < 3; ++k) {
                chosen_.boxes.low[k][chosen_.count] = around_.boxes.low[k][i];
                chosen_.boxes.high[k][chosen_.count] = around_.boxes.high[k][i];
            }
            chosen_.leaves[chosen_.count++] = around_.leaves[i];
        }
        return choose(chosen_, Rounded(ball.centre), reach);
    }

    // Triangles of leaves within a distance of a point, given its square; whether they are few.
    bool choose(const Found& found, const Rounded& centre, double reach) {
        few_ = 0;
        for (size_t i = 0; i < found.count; ++i) {
            float squares[kLeaf];
            const size_t leaf = found.leaves[i], first = nearest_.tree_.first(leaf);
            nearest_.circles_[leaf].squares(centre.x, float(nearest_.larger_), squares);
            for (size_t n = first; n < nearest_.tree_.last(leaf); ++n) {
                if (squares[n - first] > reach) continue;
                if (few_ == kFew) return false;
                const size_t t = size_t(nearest_.tree_.order[n]);
                candidates_[few_++] = Candidate(nearest_.mesh_, t);
                if (t == guess_) std::swap(candidates_[0], candidates_[few_ - 1]);  // that leaves most of the others too far
            }
        }
        return few_ > 0;
    }

    Neighbour among(const double* p) const {
        Neighbour best{candidates_[0].triangle, candidates_[0].distance.square(p)};
        for (size_t i = 1; i < few_; ++i) {
            const Candidate& one = candidates_[i];
            const double above = std::max(one.height(p) - nearest_.larger_, 0.0);  // less than from its plane
            if (above * above >= best.square) continue;
            if (double square = one.distance.square(p); square < best.square) best = {one.triangle, square};
        }
        return best;
    }

    const Nearest& nearest_;
    size_t guess_ = 0;
    Found around_, chosen_;
    float squares_[kMost];
    size_t few_ = 0;
    Candidate candidates_[kFew];  // those that are compared one by one
};

Nearest::Nearest(const MeshView& mesh, const TreeView& tree, bool closed) : mesh_(mesh), tree_(tree), circles_(tree.leaves) {
    if (closed) across_ = opposite_corners(mesh);
    double scale = 0;
    for (size_t k = 0; k < 3; ++k) scale = std::max({scale, std::abs(tree.low[3 + k]), std::abs(tree.high[3 + k])});
    larger_ = kLarger * scale, remote_ = kRemote * scale * kRemote * scale;
    tbb::parallel_for(size_t(0), tree.leaves, [&](size_t leaf) {
        for (size_t i = 0; i < kLeaf; ++i) circles_[leaf].set(i, mesh, size_t(tree.order[std::min(tree.first(leaf) + i, tree.count - 1)]), larger_);
    });
    widen();
}

// Three levels of the tree become one. Of node i those are the nodes from 8 i on.
void Nearest::widen() {
    size_t inner = 0;
    for (roots_ = tree_.leaves; roots_ >= kLeaf; roots_ /= kLeaf) inner += roots_ / kLeaf;
    wide_.resize(inner);
    for (size_t first = roots_, from = 0; from < inner; from += first, first *= kLeaf) {
        tbb::parallel_for(size_t(0), first, [&](size_t i) {
            for (size_t child = 0; child < kLeaf; ++child) {
                const size_t node = 3 * (kLeaf * (first + i) + child);
                wide_[from + i].set(child, tree_.low + node, tree_.high + node, larger_);
            }
        });
    }
}

double Nearest::to_box(const double* p, size_t node) const {
    const double *low = tree_.low + 3 * node, *high = tree_.high + 3 * node;
    double total = 0;
    for (size_t k = 0; k < 3; ++k) total += outside(p[k], low[k], high[k]);
    return total;
}

Neighbour Nearest::operator()(const double* p, size_t guess) const { return found<false>(p, guess); }

Neighbour Nearest::first(const double* p, size_t guess) const { return found<true>(p, guess); }

template <bool kFirst>
Neighbour Nearest::found(const double* p, size_t guess) const {
    struct Open {
        size_t node;
        float square;
    } open[128];
    const Rounded rounded(p);
    Neighbour best{guess, distance(guess).square(p)};
    if (best.square > remote_) return remote<kFirst>(p, best);
    int height = 0;
    for (size_t root = 0; root < roots_; ++root) open[height++] = {root, 0};
    while (height > 0) {
        auto [node, square] = open[--height];
        if (square > best.square) continue;
        if (node >= wide_.size()) {
            search<kFirst>(node - wide_.size(), p, rounded.x, best);
            continue;
        }
        float squares[kLeaf];
        wide_[node].squares(rounded.x, kLeaf, squares);
        for (size_t child = 0, first = size_t(height); child < kLeaf; ++child) {  // the nearest last
            if (!(squares[child] < best.square)) continue;
            size_t at = size_t(height++);
            for (; at > first && open[at - 1].square < squares[child]; --at) open[at] = open[at - 1];
            open[at] = {roots_ + kLeaf * node + child, squares[child]};
        }
    }
    return best;
}

template <bool kFirst>
Neighbour Nearest::remote(const double* p, Neighbour best) const {
    constexpr double sure = 1 - 1e-12;
    if (best.square > kPoint / kRemote * (kPoint / kRemote) * remote_) return {0, distance(0).square(p)};
    size_t open[128] = {1};
    for (int height = 1; height > 0;) {
        const size_t node = open[--height];
        if (to_box(p, node) * sure > best.square) continue;
        if (node < tree_.leaves) {
            const size_t nearer = 2 * node + size_t(to_box(p, 2 * node + 1) < to_box(p, 2 * node));
            open[height++] = nearer ^ 1, open[height++] = nearer;
            continue;
        }
        for (size_t i = tree_.first(node - tree_.leaves); i < tree_.last(node - tree_.leaves); ++i) {
            const size_t t = size_t(tree_.order[i]);
            if (double d = distance(t).square(p); d < best.square || (kFirst && d == best.square && t < best.triangle)) best = {t, d};
        }
    }
    return best;
}

template <bool kFirst>
void Nearest::search(size_t leaf, const double* p, const float* rounded, Neighbour& best) const {
    float squares[kLeaf];
    circles_[leaf].squares(rounded, float(larger_), squares);
    for (size_t first = tree_.first(leaf), i = first; i < tree_.last(leaf); ++i) {
        if (squares[i - first] >= best.square) continue;
        size_t t = size_t(tree_.order[i]);
        if (double d = distance(t).square(p); d < best.square || (kFirst && d == best.square && t < best.triangle)) best = {t, d};
    }
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
        near(points.subspan(3 * first, 3 * (last - first)), distances + first);
    });
}

void Nearest::near(std::span<const double> points, double* distances) const {
    auto run = std::make_unique<Run>(*this);
    uint16_t order[kSorted];
    double sorted[3 * kSorted], found[kSorted];
    for (size_t first = 0, count = points.size() / 3; first < count; first += kSorted) {
        const size_t n = std::min(kSorted, count - first);
        const double* p = &points[3 * first];
        sort(p, n, order);
        for (size_t i = 0; i < n; ++i) std::copy_n(p + 3 * order[i], 3, sorted + 3 * i);
        for (size_t i = 0; i < n; i += kRun) (*run)({sorted + 3 * i, 3 * std::min(kRun, n - i)}, found + i);
        for (size_t i = 0; i < n; ++i) distances[first + order[i]] = found[i];
    }
}

bool Nearest::around(const double* p, double reach, Found& found) const {
    found.count = 0;
    size_t open[128] = {1};
    for (int height = 1; height > 0;) {
        size_t node = open[--height];
        if (to_box(p, node) > reach) continue;
        if (node < tree_.leaves) {
            open[height++] = 2 * node, open[height++] = 2 * node + 1;
            continue;
        }
        if (found.count == kMost) return false;
        found.boxes.set(found.count, tree_.low + 3 * node, tree_.high + 3 * node, larger_);
        found.leaves[found.count++] = node - tree_.leaves;
    }
    return true;
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
