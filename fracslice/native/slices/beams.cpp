#include "beams.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "coverage.h"

namespace fracslice::slices {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Interval kNone{kInfinity, -kInfinity}, kAlways{-kInfinity, kInfinity};

Interval both(const Interval& a, const Interval& b) { return {std::max(a.begin, b.begin), std::min(a.end, b.end)}; }
Interval hull(const Interval& a, const Interval& b) { return {std::min(a.begin, b.begin), std::max(a.end, b.end)}; }

// Where slope * x <= most.
Interval below(double slope, double most) {
    if (slope == 0) return most >= 0 ? kAlways : kNone;
    return slope > 0 ? Interval{-kInfinity, most / slope} : Interval{most / slope, kInfinity};
}

Interval of_ball(const std::array<double, 4>& ball, int axis, double at, double z) {
    const double across = at - ball[size_t(1 - axis)], up = z - ball[2], middle = ball[size_t(axis)];
    const double square = ball[3] * ball[3] - across * across - up * up;
    if (!(square >= 0)) return kNone;
    const double half = std::sqrt(square);
    return {middle - half, middle + half};
}

}  // namespace

Beam::Beam(const double* balls) : length_(0), slope_(0), steep_(1) {
    for (size_t end = 0; end < 2; ++end) std::copy_n(balls + 4 * end, 4, ends_[end].begin());
    double square = 0;
    for (size_t k = 0; k < 3; ++k) axis_[k] = ends_[1][k] - ends_[0][k], square += axis_[k] * axis_[k];
    const double length = std::sqrt(square), shrinks = ends_[0][3] - ends_[1][3];
    if (std::abs(shrinks) >= length) {  // the larger ball holds the other one
        ends_[0] = ends_[1] = ends_[shrinks < 0];
        axis_ = {0, 0, 1};
    } else {
        for (double& u : axis_) u /= length;
        length_ = length, slope_ = shrinks / length, steep_ = 1 / (1 - slope_ * slope_);
    }
    std::copy_n(ends_[0].begin(), 3, from_.begin());
    radius_ = ends_[0][3];
    low_ = std::min(ends_[0][2] - ends_[0][3], ends_[1][2] - ends_[1][3]);
    high_ = std::max(ends_[0][2] + ends_[0][3], ends_[1][2] + ends_[1][3]);
}

std::array<Interval, 2> Beam::box(double z) const {
    if (!(low_ <= z && z <= high_)) return {kNone, kNone};
    // The balls that reach the height are those between two of them.
    const double up = z - from_[2];
    const Interval along = both({0, length_}, both(below(slope_ - axis_[2], radius_ - up), below(slope_ + axis_[2], radius_ + up)));
    if (!(along.begin <= along.end)) return {kNone, kNone};
    std::array<Interval, 2> box{kNone, kNone};
    for (double place : {along.begin, along.end}) {
        const double radius = radius_ - slope_ * place;
        for (size_t k = 0; k < 2; ++k) {
            const double middle = from_[k] + axis_[k] * place;
            box[k] = hull(box[k], {middle - radius, middle + radius});
        }
    }
    return box;
}

// Of the balls at its ends, and of the cone between the circles in which it touches these. On the line, of coordinate x from the
// start, a point is t = t0 + u x along the axis, and in the cone if (x x + c) - t t <= (r - s t)^2 / (1 - s s) with r - s t >= 0.
Interval Beam::chord(int axis, double at, double z) const {
    const size_t own = size_t(axis), other = size_t(1 - axis);
    const double across = at - from_[other], up = z - from_[2], u = axis_[own];
    Interval whole = hull(of_ball(ends_[0], axis, at, z), of_ball(ends_[1], axis, at, z));
    if (length_ == 0) return whole;
    const double t0 = across * axis_[other] + up * axis_[2], r = radius_ - slope_ * t0, c = across * across + up * up;
    // a x x + 2 b x + c0 <= 0
    const double a = 1 - u * u * steep_, b = u * (steep_ * r * slope_ - t0), c0 = c - t0 * t0 - steep_ * r * r;
    const double square = b * b - a * c0;
    if (!(square >= 0)) return whole;
    // Of each root the form that loses no digits (Press et al. 2007, "Numerical Recipes", 5.6).
    const double q = -(b + std::copysign(std::sqrt(square), b)), one = q / a, two = c0 / q;
    const auto [least, most] = std::minmax(one, two);
    Interval cone = a > 0 ? Interval{least, most} : slope_ * u < 0 ? Interval{most, kInfinity} : Interval{-kInfinity, least};
    const double first = radius_ * slope_, last = length_ + (radius_ - slope_ * length_) * slope_;
    cone = both(cone, both(below(u, last - t0), below(-u, t0 - first)));
    if (!(cone.begin <= cone.end)) return whole;
    cone.begin += from_[own], cone.end += from_[own];
    return hull(whole, cone);
}

Beams::Beams(std::span<const double> balls, double floor, std::span<const double> planes) : floor(floor) {
    for (size_t i = 0; i < balls.size(); i += 8) beams.emplace_back(&balls[i]);
    for (size_t i = 0; i < planes.size(); i += 4) plate.push_back({planes[i], planes[i + 1], planes[i + 2], planes[i + 3]});
}

int32_t BeamSlab::Span::first() const { return int32_t(std::ceil(begin)); }
int32_t BeamSlab::Span::last() const { return int32_t(std::floor(end)); }

BeamSlab::BeamSlab(std::shared_ptr<Memory> memory, std::shared_ptr<const Beams> beams, const Frame& frame, std::vector<double> z,
                   int ny, int nx)
    : Slab(std::move(memory), frame, std::move(z), ny, nx), beams_(std::move(beams)), samples_{nx, ny} {}

void BeamSlab::sample(int layer) {
    begin(layer);
    drop(kTiles, tx_);
    widths_.assign(beams_->beams.size() + 1, {0, 0});
    for (int axis = 0; axis < 2; ++axis) cut(axis);
    for (const Span& row : spans_[0]) fill(row);
    surround();
    Tiles::cross.resize(count()), tips.resize(count());
    known_.assign(count(), {});
    for (int axis = 0; axis < 2; ++axis)
        for (const Span& span : spans_[size_t(axis)]) cross(axis, span);
    turn();
    bend();
}

// Shares before crossings, of parts that are inside; those of spans that rounding lost are none.
void BeamSlab::turn() {
    for (size_t t = kTiles; t < count(); ++t) {
        const uint64_t own = inside[t];
        const uint64_t beyond[] = {rights(own, inside[size_t(beside[t][0])]), uppers(own, inside[size_t(beside[t][2])])};
        for (size_t axis = 0; axis < 2; ++axis) {
            uint16_t* shares = &Tiles::cross[t][64 * axis];
            each((own ^ beyond[axis]) & ~known_[t].crossed[axis], [&](int bit) { shares[bit] = 0; });
            each(~own & beyond[axis], [&](int bit) { shares[bit] = uint16_t(kWhole) - shares[bit]; });
        }
    }
}

// Outlines are arcs between the crossings: the area beside their chords, that of a circle as wide as the section of the beam.
void BeamSlab::bend() {
    constexpr float kLeast = 1e-3f;  // of a pixel's area
    for (size_t t = kTiles; t < count(); ++t) {
        if (!known_[t].curved) continue;
        const Quad tiles(*this, place[t]);
        const Corners corners(*this, tiles);
        const Cells cells(*this, 0, tiles);
        each(corners.mixed() & ~corners.alternating() & known_[t].curved, [&](int bit) {
            const Sides s = cells.sides(bit);
            const std::array<std::array<float, 2>, 4> places{{{s[0], 0}, {1, s[1]}, {s[2], 1}, {0, s[3]}}};
            const int signs = corners.signs(bit), turns = (signs ^ (signs >> 1 | signs << 3)) & 15;
            const size_t first = size_t(std::countr_zero(unsigned(turns))) & 3, last = size_t(std::bit_width(unsigned(turns)) - 1) & 3;
            const auto &a = places[first], &b = places[last];
            const float square = (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
            const float bulge = values[t][size_t(bit)] * square * std::sqrt(square) / 12;
            if (bulge >= kLeast) tips[t][size_t(bit)] = bulge, sharp[t] |= uint64_t(1) << bit;
        });
    }
}

// The parts of the lines along an axis that are in beams, or in the plate.
void BeamSlab::cut(int axis) {
    spans_[size_t(axis)].clear();
    const size_t other = size_t(1 - axis);
    const double z = z_[size_t(layer_)], first = other ? frame_.y0 : frame_.x0, step = other ? frame_.dy : frame_.dx;
    const int32_t lines = samples_[other];
    if (z >= beams_->floor) {
        for (size_t i = 0; i < beams_->beams.size(); ++i) {
            const Beam& beam = beams_->beams[i];
            const Interval across = beam.box(z)[other];
            if (!(across.begin <= across.end)) continue;
            const int32_t begin = std::max(int32_t(std::ceil((across.begin - first) / step)), 0);
            const int32_t end = std::min(int32_t(std::floor((across.end - first) / step)), lines - 1);
            for (int32_t line = begin; line <= end; ++line) put(axis, line, int32_t(i), beam.chord(axis, first + step * line, z));
        }
    }
    for (int32_t line = 0; line < lines && !beams_->plate.empty(); ++line) {
        Interval part = kAlways;
        for (const auto& plane : beams_->plate)
            part = both(part, below(plane[size_t(axis)], plane[3] - plane[2] * z - plane[other] * (first + step * line)));
        put(axis, line, int32_t(beams_->beams.size()), part);
    }
}

// Takes a part in which there are samples.
void BeamSlab::put(int axis, int32_t line, int32_t beam, const Interval& part) {
    if (!(part.begin <= part.end)) return;
    const double first = axis ? frame_.y0 : frame_.x0, step = axis ? frame_.dy : frame_.dx;
    const Span span{line, beam, (part.begin - first) / step, (part.end - first) / step};
    double& width = widths_[size_t(beam)][size_t(axis)];
    if (size_t(beam) < beams_->beams.size()) width = std::max(width, (span.end - span.begin) / 2);
    if (span.first() > span.last()) return;
    const int32_t rim = std::min(line, samples_[size_t(1 - axis)] - 1 - line);
    if (rim < 1 || span.first() < 1 || span.last() > samples_[size_t(axis)] - 2)
        throw std::domain_error("supports reach the border of the layers");
    spans_[size_t(axis)].push_back(span);
}

void BeamSlab::fill(const Span& row) {
    const int32_t y = row.line / kTile + 1, first = row.first(), last = row.last();
    for (int32_t x = first / kTile + 1; x <= last / kTile + 1; ++x) {
        const int32_t from = std::max(first - kTile * (x - 1), 0), to = std::min(last - kTile * (x - 1), kTile - 1);
        const int32_t here = at(y, x), t = here < kTiles ? add(y, x) : here;
        inside[size_t(t)] |= ((uint64_t(2) << to) - (uint64_t(1) << from)) << kTile * (row.line % kTile);
    }
}

// Tiles beside those whose first samples are inside: their last cells are cut.
void BeamSlab::surround() {
    for (size_t t = kTiles, n = count(); t < n; ++t) {
        const auto [y, x, otherwise] = place[t];
        const uint64_t own = inside[t];
        if (own & kFirstColumn && at(y, x - 1) < kTiles) add(y, x - 1);
        if (own & kFirstRow && at(y - 1, x) < kTiles) add(y - 1, x);
        if (own & 1 && at(y - 1, x - 1) < kTiles) add(y - 1, x - 1);
    }
}

// The parts inside of the edges at both ends of a span; of several, the larger.
void BeamSlab::cross(int axis, const Span& span) {
    const auto [wide, deep] = widths_[size_t(span.beam)];
    const float curvature = wide * deep > 0 ? float(1 / std::sqrt(wide * deep)) : 0;
    auto curve = [&](int32_t row, int32_t column) {
        const int32_t t = at(row / kTile + 1, column / kTile + 1), bit = kTile * (row % kTile) + column % kTile;
        if (t < kTiles) return;
        values[size_t(t)][size_t(bit)] = curvature;
        known_[size_t(t)].curved |= uint64_t(1) << bit;
    };
    auto put = [&](int32_t from, int32_t inner, int32_t outer, double part) {
        const auto in = axis ? std::pair(inner, span.line) : std::pair(span.line, inner);
        const auto out = axis ? std::pair(outer, span.line) : std::pair(span.line, outer);
        if (!is_inside(in.first, in.second) || is_inside(out.first, out.second)) return;
        const auto [row, column] = from == inner ? in : out;
        const int32_t t = at(row / kTile + 1, column / kTile + 1);
        const int bit = kTile * (row % kTile) + column % kTile;
        uint16_t& kept = Tiles::cross[size_t(t)][size_t(64 * axis + bit)];
        uint64_t& known = known_[size_t(t)].crossed[size_t(axis)];
        kept = known >> bit & 1 ? std::max(kept, share_of(float(part))) : share_of(float(part));
        known |= uint64_t(1) << bit;
        curve(row, column), curve(row - !axis, column - axis);
    };
    const int32_t first = span.first(), last = span.last();
    put(first - 1, first, first - 1, first - span.begin);
    put(last, last, last + 1, span.end - last);
}

bool BeamSlab::is_inside(int32_t row, int32_t column) const {
    return word(row / kTile + 1, column / kTile + 1) >> (kTile * (row % kTile) + column % kTile) & 1;
}

}  // namespace fracslice::slices
