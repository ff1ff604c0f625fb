#include "outline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "predicates.h"

namespace fracslice::mesh {
namespace {

constexpr size_t kSegments = 4;  // in a leaf, at most

}  // namespace

Outline::Outline(std::span<const double> corners, std::span<const int64_t> ends) : entry_(entry_of(this)) {
    const auto point = [&](size_t i) { return Point{corners[2 * i], corners[2 * i + 1]}; };
    size_t begin = 0;
    for (int64_t end : ends) {
        for (size_t i = begin; i < size_t(end); ++i) {
            const size_t next = i + 1 == size_t(end) ? begin : i + 1;
            segments_.push_back({point(i), point(next), {i, next}});
        }
        begin = size_t(end);
    }
    set_places();
    while (leaves_ * kSegments < segments_.size()) leaves_ *= 2;
    boxes_.resize(2 * leaves_), first_.assign(leaves_ + 1, segments_.size());
    halve(1, segments_);
    const Box& all = boxes_[1];
    wider_ = 0x1p-48 * std::max({std::abs(all.low.x), std::abs(all.low.y), std::abs(all.high.x), std::abs(all.high.y)});
}

// Corners of one place have one number, under which the segments there are listed.
void Outline::set_places() {
    std::vector<size_t> order(segments_.size());
    std::iota(order.begin(), order.end(), size_t(0));
    const auto key = [&](size_t i) { return std::pair(segments_[i].from.x, segments_[i].from.y); };
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return key(a) < key(b); });
    std::vector<size_t> place(order.size());
    size_t count = 0;
    for (size_t i = 0; i < order.size(); ++i) {
        if (i > 0 && key(order[i]) != key(order[i - 1])) ++count;
        place[order[i]] = count;
    }
    spokes_at_.assign(count + 2, 0);
    for (Segment& segment : segments_) {
        for (size_t& corner : segment.place) ++spokes_at_[(corner = place[corner]) + 1];
    }
    std::partial_sum(spokes_at_.begin(), spokes_at_.end(), spokes_at_.begin());
    spokes_.resize(spokes_at_.back());
    std::vector<size_t> next(spokes_at_);
    for (const Segment& segment : segments_) {
        spokes_[next[segment.place[0]]++] = {segment.to, true};
        spokes_[next[segment.place[1]]++] = {segment.from, false};
    }
}

void Outline::halve(size_t node, std::span<Segment> segments) {
    constexpr double far = std::numeric_limits<double>::infinity();
    Box box{{far, far}, {-far, -far}};
    for (const Segment& segment : segments) {
        for (const Point& p : {segment.from, segment.to}) {
            box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y)};
            box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y)};
        }
    }
    boxes_[node] = box;
    if (node >= leaves_) {
        first_[node - leaves_] = size_t(segments.data() - segments_.data());
        return;
    }
    const bool wide = box.high.x - box.low.x > box.high.y - box.low.y;
    const auto along = [wide](const Segment& s) { return wide ? s.from.x + s.to.x : s.from.y + s.to.y; };
    const size_t half = segments.size() / 2;
    std::nth_element(segments.begin(), segments.begin() + std::ptrdiff_t(half), segments.end(),
                     [&](const Segment& a, const Segment& b) { return along(a) < along(b); });
    halve(2 * node, segments.first(half));
    halve(2 * node + 1, segments.subspan(half));
}

double Outline::to_box(const double* p, const Box& box) const {
    const double x = std::max({0.0, box.low.x - p[0] - wider_, p[0] - box.high.x - wider_});
    const double y = std::max({0.0, box.low.y - p[1] - wider_, p[1] - box.high.y - wider_});
    return (x * x + y * y) * (1 - 0x1p-40);
}

void Outline::look(const double* p, size_t i, Found& best) const {
    const Segment& s = segments_[i];
    const double ux = s.to.x - s.from.x, uy = s.to.y - s.from.y;
    double vx = p[0] - s.from.x, vy = p[1] - s.from.y;
    const double t = vx * ux + vy * uy, length = ux * ux + uy * uy;
    double square;
    int corner = -1;
    if (t <= 0) {
        corner = 0, square = vx * vx + vy * vy;
    } else if (t >= length) {
        vx = p[0] - s.to.x, vy = p[1] - s.to.y;
        corner = 1, square = vx * vx + vy * vy;
    } else {
        const double across = vx * uy - vy * ux;
        square = across * across / length;
    }
    // Of several the first: what is found does not depend on where the search began.
    if (square < best.square || (square == best.square && i < best.segment)) best = {square, i, corner};
}

Outline::Found Outline::nearest(const double* p, size_t guess) const {
    Found best{std::numeric_limits<double>::infinity(), segments_.size(), -1};
    look(p, guess, best);
    struct Open {
        size_t node;
        double square;
    } open[128] = {{1, 0}};
    for (int height = 1; height > 0;) {
        auto [node, square] = open[--height];
        if (square > best.square) continue;
        if (node >= leaves_) {
            for (size_t i = first_[node - leaves_]; i < first_[node - leaves_ + 1]; ++i) look(p, i, best);
            continue;
        }
        Open left{2 * node, to_box(p, boxes_[2 * node])}, right{2 * node + 1, to_box(p, boxes_[2 * node + 1])};
        if (left.square < right.square) std::swap(left, right);
        open[height++] = left, open[height++] = right;
    }
    return best;
}

double Outline::operator()(const double* p, size_t& guess) const {
    if (!std::isfinite(p[0] + p[1])) return std::abs(p[0]) + std::abs(p[1]);
    if (guess >= segments_.size()) guess = 0;  // of another outline
    const Found found = nearest(p, guess);
    guess = found.segment;
    const double distance = std::sqrt(found.square);
    const Box& all = boxes_[1];  // from far away its corners are one point, which has no sides
    if (p[0] < all.low.x || p[0] > all.high.x || p[1] < all.low.y || p[1] > all.high.y) return distance;
    return distance != 0 && inside(p, found) ? -distance : distance;
}

bool Outline::inside(const double* p, const Found& found) const {
    const Segment& s = segments_[found.segment];
    if (found.corner < 0) return side_of_line(s.from.x, s.from.y, s.to.x, s.to.y, p[0], p[1]) > 0;
    // The first spoke clockwise from the point: inside is on the left of segments, so on this side of one that leaves.
    const Point at = found.corner == 0 ? s.from : s.to;
    const size_t place = s.place[found.corner];
    const auto side = [&](const Point& a, const Point& b) { return side_of_line(at.x, at.y, a.x, a.y, b.x, b.y); };
    const Point here{p[0], p[1]};
    const Spoke* first = nullptr;
    int first_turn = 0;
    for (size_t i = spokes_at_[place]; i < spokes_at_[place + 1]; ++i) {
        const Spoke& spoke = spokes_[i];
        const int turn = side(here, spoke.end) < 0 ? 0 : 1;  // half of the circle, clockwise
        if (!first || turn < first_turn || (turn == first_turn && side(first->end, spoke.end) > 0)) first = &spoke, first_turn = turn;
    }
    return first->leaves;
}

}  // namespace fracslice::mesh
