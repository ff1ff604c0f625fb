#include "beams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace fracslice::mesh {
namespace {

constexpr size_t kBeams = 4;  // in a leaf, at most
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

Beams::Beams(std::span<const double> balls, std::span<const int32_t> chains, double seam) : seam_(seam), entry_(entry_of(this)) {
    for (size_t i = 0; i < chains.size(); ++i) beams_.push_back(beam_of(&balls[8 * i])), beams_[i].chain = chains[i];
    while (leaves_ * kBeams < beams_.size()) leaves_ *= 2;
    boxes_.resize(2 * leaves_), first_.assign(leaves_ + 1, beams_.size());
    halve(1, beams_);
    for (size_t k = 0; k < 3; ++k) wider_ = std::max({wider_, std::abs(boxes_[1].low[k]), std::abs(boxes_[1].high[k])});
    wider_ *= 0x1p-40;
}

Beams::Beam Beams::beam_of(const double* balls) {
    const double *one = balls, *other = balls + 4;
    Beam beam{};
    double square = 0;
    for (size_t k = 0; k < 3; ++k) {
        beam.from[k] = one[k], beam.axis[k] = other[k] - one[k];
        square += beam.axis[k] * beam.axis[k];
        beam.low[k] = std::min(one[k] - one[3], other[k] - other[3]), beam.high[k] = std::max(one[k] + one[3], other[k] + other[3]);
    }
    beam.length = std::sqrt(square), beam.radius = one[3];
    if (std::abs(other[3] - one[3]) >= beam.length) {  // the larger ball holds the other one
        const double* larger = one[3] >= other[3] ? one : other;
        std::copy_n(larger, 3, beam.from), std::fill_n(beam.axis, 3, 0.0);
        beam.length = 0, beam.radius = larger[3];
        return beam;
    }
    for (double& u : beam.axis) u /= beam.length;
    beam.slope = (one[3] - other[3]) / beam.length;
    beam.apart = beam.slope / std::sqrt(1 - beam.slope * beam.slope);
    return beam;
}

void Beams::halve(size_t node, std::span<Beam> beams) {
    Box box;
    std::fill_n(box.low, 3, kInfinity), std::fill_n(box.high, 3, -kInfinity);
    for (const Beam& beam : beams) {
        for (size_t k = 0; k < 3; ++k) box.low[k] = std::min(box.low[k], beam.low[k]), box.high[k] = std::max(box.high[k], beam.high[k]);
    }
    boxes_[node] = box;
    if (node >= leaves_) {
        first_[node - leaves_] = size_t(beams.data() - beams_.data());
        return;
    }
    size_t widest = 0;
    for (size_t k = 1; k < 3; ++k) widest = box.high[k] - box.low[k] > box.high[widest] - box.low[widest] ? k : widest;
    const auto along = [widest](const Beam& beam) { return beam.low[widest] + beam.high[widest]; };
    const size_t half = beams.size() / 2;
    std::nth_element(beams.begin(), beams.begin() + std::ptrdiff_t(half), beams.end(),
                     [&](const Beam& a, const Beam& b) { return along(a) < along(b); });
    halve(2 * node, beams.first(half));
    halve(2 * node + 1, beams.subspan(half));
}

// The distance from a ball of the beam is a convex function of the ball's place.
double Beams::to_beam(const double* p, size_t i) const {
    const Beam& beam = beams_[i];
    double along = 0, square = 0;
    for (size_t k = 0; k < 3; ++k) along += (p[k] - beam.from[k]) * beam.axis[k];
    for (size_t k = 0; k < 3; ++k) {
        const double x = p[k] - beam.from[k] - along * beam.axis[k];
        square += x * x;
    }
    double place = beam.apart == 0 ? along : along - beam.apart * std::sqrt(square);
    place = std::isnan(place) ? 0 : std::clamp(place, 0.0, beam.length);  // of points whose squares are no numbers
    return std::sqrt(square + (along - place) * (along - place)) - (beam.radius - beam.slope * place);
}

// At most the distance of all that is in the box, also inside of it.
double Beams::to_box(const double* p, const Box& box) const {
    double square = 0, deep = -kInfinity;
    for (size_t k = 0; k < 3; ++k) {
        const double away = std::max(box.low[k] - p[k], p[k] - box.high[k]) - wider_;
        square += away > 0 ? away * away : 0, deep = std::max(deep, away);
    }
    return square > 0 ? std::sqrt(square) * (1 - 0x1p-40) : deep;
}

template <class Look>
void Beams::search(const double* p, const double& limit, bool sorted, const Look& look) const {
    struct Open {
        size_t node;
        double least;
    } open[128] = {{1, to_box(p, boxes_[1])}};
    for (int height = 1; height > 0;) {
        const auto [node, least] = open[--height];
        if (least > limit) continue;
        if (node >= leaves_) {
            for (size_t i = first_[node - leaves_]; i < first_[node - leaves_ + 1]; ++i) look(i);
            continue;
        }
        Open left{2 * node, to_box(p, boxes_[2 * node])}, right{2 * node + 1, to_box(p, boxes_[2 * node + 1])};
        if (sorted && left.least < right.least) std::swap(left, right);
        open[height++] = left, open[height++] = right;
    }
}

double Beams::operator()(const double* p, size_t& found) const {
    if (!std::isfinite(p[0] + p[1] + p[2])) return std::numeric_limits<double>::quiet_NaN();
    if (found >= beams_.size()) found = 0;  // of others
    double nearest = to_beam(p, found);
    search(p, nearest, true, [&](size_t i) {
        const double distance = to_beam(p, i);
        if (distance < nearest) nearest = distance, found = i;
    });
    return seam_ > 0 ? blended(p, nearest) : nearest;
}

double Beams::blended(const double* p, double nearest) const {
    struct Near {
        int32_t chain;
        double begin;  // f from which on it has a part
    };
    thread_local std::vector<Near> near;
    near.clear();
    const double limit = nearest + seam_;
    search(p, limit, false, [&](size_t i) {
        if (const double distance = to_beam(p, i); distance < limit) near.push_back({beams_[i].chain, distance - seam_});
    });
    std::sort(near.begin(), near.end(), [](const Near& a, const Near& b) { return std::pair(a.chain, a.begin) < std::pair(b.chain, b.begin); });
    near.erase(std::unique(near.begin(), near.end(), [](const Near& a, const Near& b) { return a.chain == b.chain; }), near.end());
    // The sum is convex and grows with f: Newton's steps from the right end where it no longer shrinks.
    for (double f = nearest, before = kInfinity; near.size() > 1;) {
        double sum = -seam_ * seam_, slope = 0;
        for (const Near& one : near) {
            const double part = std::max(0.0, f - one.begin);
            sum += part * part, slope += 2 * part;
        }
        before = f, f -= sum / slope;
        if (!(f < before)) return before;
    }
    return nearest;
}

}  // namespace fracslice::mesh
