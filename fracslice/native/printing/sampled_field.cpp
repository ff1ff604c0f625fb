#include "sampled_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "../disjoint_sets.h"

namespace fracslice::printing {
namespace {

constexpr double kStep = 0.5;    // along a ray, voxels
constexpr double kFirst = 0.1;   // the first step of one that starts on the surface
constexpr double kNear = 1.5;    // minimum distance of unsampled points from the surface, voxels
constexpr double kAlong = 0.999;  // fraction of a normal's largest component above which another component ties with it
constexpr int kBrick = volume::kSide;

int64_t floor_of(double x) { return int64_t(std::floor(x)); }

double largest(const Point& p) { return std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}); }

Point along(const Point& start, double s, const Point& direction) {
    return {start[0] + s * direction[0], start[1] + s * direction[1], start[2] + s * direction[2]};
}

// Chessboard distance, in bricks, of each brick to the nearest sampled one: two passes over the neighbours that come before, and
// those that come after (Rosenfeld and Pfaltz 1968, "Distance functions on digital pictures").
std::vector<int32_t> steps_to_samples(const volume::Layout& bricks) {
    const auto [nx, ny, nz] = bricks.size;
    const size_t count = size_t(nx) * size_t(ny) * size_t(nz);
    std::vector<int32_t> steps(count, bricks.count ? nx + ny + nz : 0);
    auto visit = [&](int x, int y, int z, int sign) {
        int32_t& here = steps[(size_t(x) * size_t(ny) + size_t(y)) * size_t(nz) + size_t(z)];
        for (int n = 0; n < 13; ++n) {
            const int u = x + sign * (n / 9 - 1), v = y + sign * (n / 3 % 3 - 1), w = z + sign * (n % 3 - 1);
            if (u < 0 || v < 0 || w < 0 || u >= nx || v >= ny || w >= nz) continue;
            here = std::min(here, steps[(size_t(u) * size_t(ny) + size_t(v)) * size_t(nz) + size_t(w)] + 1);
        }
    };
    for (size_t b = 0; b < count; ++b) {
        if (bricks.index[b] >= 0) steps[b] = 0;
    }
    for (int x = 0; x < nx; ++x)
        for (int y = 0; y < ny; ++y)
            for (int z = 0; z < nz; ++z) visit(x, y, z, 1);
    for (int x = nx; x-- > 0;)
        for (int y = ny; y-- > 0;)
            for (int z = nz; z-- > 0;) visit(x, y, z, -1);
    return steps;
}

}  // namespace

SampledField::SampledField(const volume::Bricks& bricks, const Point& origin, double voxel)
    : bricks_(bricks), origin_(origin), voxel_(voxel), bounds_(brick_bounds()) {}

std::vector<float> SampledField::brick_bounds() const {
    const std::vector<int32_t> steps = steps_to_samples(bricks_);
    std::vector<float> bounds(steps.size());
    for (size_t b = 0; b < bounds.size(); ++b) {
        const double far = std::max(double((steps[b] - 1) * kBrick), kNear) * voxel_;
        bounds[b] = float(bricks_.index[b] == volume::kInside ? -far : far);
    }
    return bounds;
}

Point SampledField::in_voxels(const Point& p) const {
    return {(p[0] - origin_[0]) / voxel_, (p[1] - origin_[1]) / voxel_, (p[2] - origin_[2]) / voxel_};
}

double SampledField::between(const Point& place) const {
    auto [u, v, w] = place;
    const int64_t i = floor_of(u), j = floor_of(v), k = floor_of(w);
    u -= double(i), v -= double(j), w -= double(k);
    const int64_t p = i & 7, q = j & 7, r = k & 7, x = i >> 3, y = j >> 3, z = k >> 3;
    const bool known = within(x, y, z), is_inner = std::max({p, q, r}) < 7;
    const int32_t row = known ? bricks_.index[brick(x, y, z)] : 0;
    if (row < 0 && (is_inner || std::abs(bound(x, y, z)) > kBrick / 2 * voxel_)) return bound(x, y, z);
    if (known && is_inner) {
        const float* f = bricks_.values + size_t(row) * volume::kSamples + 64 * p + 8 * q + r;
        const double a = (1 - w) * f[0] + w * f[1], b = (1 - w) * f[8] + w * f[9];
        const double c = (1 - w) * f[64] + w * f[65], d = (1 - w) * f[72] + w * f[73];
        return (1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d);
    }
    double total = 0;
    for (int n = 0; n < 8; ++n) {
        const int a = n >> 2, b = n >> 1 & 1, c = n & 1;
        const double share = (a ? u : 1 - u) * (b ? v : 1 - v) * (c ? w : 1 - w);
        total += share * sample(i + a, j + b, k + c);
    }
    return total;
}

// At a grid point, or a bound if it has no sample.
double SampledField::sample(int64_t i, int64_t j, int64_t k) const {
    const int64_t x = i >> 3, y = j >> 3, z = k >> 3;
    if (!within(x, y, z)) {
        const auto [nx, ny, nz] = bricks_.size;
        const int64_t beyond = std::max({-i, i - 8 * nx + 1, -j, j - 8 * ny + 1, -k, k - 8 * nz + 1});
        return voxel_ * (kNear + double(beyond) - 1);
    }
    const int32_t row = bricks_.index[brick(x, y, z)];
    if (row < 0) return bound(x, y, z);
    return bricks_.values[size_t(row) * volume::kSamples + size_t((i & 7) * 64 + (j & 7) * 8 + (k & 7))];
}

double SampledField::capsule_value(const Point& point, double radius) const {
    const Point place = in_voxels(point);
    const double value = between(place);
    if (value > voxel_) return value;  // a bound suffices
    auto [u, v, w] = place;
    const int64_t i = floor_of(u), j = floor_of(v), k = floor_of(w);
    u -= double(i), v -= double(j), w -= double(k);
    double square = -voxel_ * voxel_ * (u * (1 - u) + v * (1 - v) + w * (1 - w));
    for (int n = 0; n < 8; ++n) {
        const int a = n >> 2, b = n >> 1 & 1, c = n & 1;
        const double share = (a ? u : 1 - u) * (b ? v : 1 - v) * (c ? w : 1 - w);
        const double distance = radius + sample(i + a, j + b, k + c);
        square += share * (distance * distance);
    }
    return std::sqrt(std::max(square, 0.0)) - radius;
}

void SampledField::gather(size_t row, Neighbourhood& f) const {
    constexpr std::array<int, 4> first{0, 1, 9, 11};  // of the brick before, this one, and the one behind; and the end
    const int32_t* ijk = bricks_.ijk + 3 * row;
    const int64_t x = ijk[0] >> 3, y = ijk[1] >> 3, z = ijk[2] >> 3;
    for (int n = 0; n < 27; ++n) {
        const int a = n / 9, b = n / 3 % 3, c = n % 3;
        const int64_t u = x + a - 1, v = y + b - 1, w = z + c - 1;
        const bool known = within(u, v, w);
        const int32_t there = known ? bricks_.index[brick(u, v, w)] : -1;
        const float flat = known ? bounds_[brick(u, v, w)] : bounds_[brick(x, y, z)];
        for (int i = first[a]; i < first[a + 1]; ++i)
            for (int j = first[b]; j < first[b + 1]; ++j)
                for (int k = first[c]; k < first[c + 1]; ++k) {
                    const size_t at = size_t(((i + 7) & 7) << 6 | ((j + 7) & 7) << 3 | ((k + 7) & 7));
                    f[size_t((i * kAround + j) * kAround + k)] =
                        there >= 0 ? bricks_.values[size_t(there) * volume::kSamples + at] : flat;
                }
    }
}

void SampledField::find_beside() const {
    beside_.resize(bricks_.count * volume::kSamples);
    Neighbourhood f;
    std::array<uint8_t, std::tuple_size_v<Neighbourhood>> one, two{};  // signs among the samples near each
    for (size_t row = 0; row < bricks_.count; ++row) {
        gather(row, f);
        for (size_t s = 0; s < f.size(); ++s) one[s] = f[s] < 0 ? 1 : 2;
        for (size_t step : {1, kAround, kAround * kAround}) {
            for (size_t s = step; s < f.size() - step; ++s) two[s] = one[s - step] | one[s] | one[s + step];
            std::swap(one, two);
        }
        for (int s = 0; s < volume::kSamples; ++s) {
            const int at = ((s >> 6) + 1) * kAround * kAround + ((s >> 3 & 7) + 1) * kAround + (s & 7) + 1;
            beside_[row * volume::kSamples + size_t(s)] = one[size_t(at)] == 3;
        }
    }
}

// Whether the cell around a place has corners on both sides.
bool SampledField::is_mixed(const Point& place) const {
    const int64_t i = floor_of(place[0]), j = floor_of(place[1]), k = floor_of(place[2]);
    int inside = 0;
    for (int n = 0; n < 8; ++n) inside += sample(i + (n >> 2), j + (n >> 1 & 1), k + (n & 1)) < 0;
    return 0 < inside && inside < 8;
}

// Whether the nearest sample of a place has the opposite sign beside it.
bool SampledField::is_beside(const Point& place) const {
    const int64_t i = floor_of(place[0] + 0.5), j = floor_of(place[1] + 0.5), k = floor_of(place[2] + 0.5);
    if (!within(i >> 3, j >> 3, k >> 3)) return false;
    const int32_t row = bricks_.index[brick(i >> 3, j >> 3, k >> 3)];
    return row >= 0 && beside_[size_t(row) * volume::kSamples + size_t((i & 7) << 6 | (j & 7) << 3 | (k & 7))];
}

std::vector<double> SampledField::free(const Rays& rays, std::span<const double> far) const {
    std::call_once(once_, [&] { find_beside(); });
    std::vector<double> result(far.size());
    for (size_t n = 0; n < far.size(); ++n) {
        const Point from = in_voxels(rays.start[n]);
        double s = 0;
        for (; s < far[n] / voxel_; s += kStep) {
            const Point place = along(from, s, rays.directions[n]);
            if (is_beside(place) && is_mixed(place)) break;
        }
        result[n] = std::min(voxel_ * s, far[n]);
    }
    return result;
}

std::vector<double> SampledField::through(const Rays& rays, double limit, double towards) const {
    std::call_once(once_, [&] { find_beside(); });
    std::vector<double> result(rays.start.size(), 2 * limit);
    for (size_t n = 0; n < result.size(); ++n) {
        const Point from = in_voxels(rays.start[n]);
        double before = 0;
        for (double s = kFirst; s < limit / voxel_ + 1; s += kStep) {
            const Point place = along(from, s, rays.directions[n]);
            const double f = is_beside(place) ? towards * between(place) : -1.0;
            if (f >= 0) {
                result[n] = voxel_ * (s - (before < 0 ? kStep * f / (f - before) : 0.0));
                break;
            }
            before = f;
        }
    }
    return result;
}

namespace {

// The unit normal at `share` along an edge from *f, by interpolated central differences over a voxel.
Point normal_at(const float* f, int axis, float share, const std::array<int, 3>& steps) {
    const int next = steps[size_t(axis)];
    Point normal;
    double total = 0;
    for (int k = 0; k < 3; ++k) {
        const int step = steps[size_t(k)];
        double slope;
        if (k != axis) {
            const float here = f[step] - f[-step], there = f[next + step] - f[next - step];
            slope = ((1.0 - share) * here + share * there) / 2;
        } else if (share < 0.5) {
            const double middle = f[0] + (share + 0.5) * (f[next] - f[0]);
            slope = middle - f[-next] - (share + 0.5) * (f[0] - f[-next]);
        } else {
            const double middle = f[0] + (share - 0.5) * (f[next] - f[0]);
            slope = f[next] + (share - 0.5) * (f[2 * next] - f[next]) - middle;
        }
        normal[size_t(k)] = slope;
        total += slope * slope;
    }
    const double length = std::max(std::sqrt(total), 1e-30);
    for (double& component : normal) component /= length;
    return normal;
}

}  // namespace

Crossings SampledField::crossings(std::span<const int64_t> rows) const {
    constexpr std::array<int, 3> steps{kAround * kAround, kAround, 1};
    Crossings result;
    Neighbourhood f;
    for (int64_t row : rows) {
        gather(size_t(row), f);
        const int32_t* ijk = bricks_.ijk + 3 * row;
        for (int s = 0; s < volume::kSamples; ++s) {
            const std::array<int, 3> at{s >> 6, s >> 3 & 7, s & 7};
            const float* here = &f[size_t((at[0] + 1) * steps[0] + (at[1] + 1) * steps[1] + at[2] + 1)];
            for (int axis = 0; axis < 3; ++axis) {
                const float there = here[steps[size_t(axis)]];
                if ((here[0] < 0) == (there < 0)) continue;
                const float share = here[0] / (here[0] - there);
                const Point normal = normal_at(here, axis, share, steps);
                const double steep = std::abs(normal[size_t(axis)]);
                if (steep < kAlong * largest(normal)) continue;
                Point point;
                for (size_t k = 0; k < 3; ++k) point[k] = origin_[k] + voxel_ * (ijk[k] + at[k]);
                point[size_t(axis)] += voxel_ * share;
                result.points.push_back(point);
                result.normals.push_back(normal);
                result.area.push_back(voxel_ * voxel_ / steep);
            }
        }
    }
    return result;
}

// A point as deep is farther from each corner of its cell than what the value there exceeds -depth by; of two opposite corners,
// the squares of its distances are at most three in sum.
bool SampledField::may_be_deep(double depth, double lipschitz) const {
    constexpr std::array<int, 3> steps{kAround * kAround, kAround, 1};
    const size_t count = bounds_.size(), samples = bricks_.count * volume::kSamples;
    if (std::find(bricks_.index, bricks_.index + count, volume::kInside) != bricks_.index + count) return true;
    const double unit = lipschitz * voxel_;
    if (!samples || *std::min_element(bricks_.values, bricks_.values + samples) <= -depth * unit) return samples > 0;
    auto square = [&](float f) {
        const double away = std::max(f / unit + depth, 0.0);
        return away * away;
    };
    Neighbourhood f;
    for (size_t row = 0; row < bricks_.count; ++row) {
        gather(row, f);
        for (int s = 0; s < volume::kSamples; ++s) {
            const float* here = &f[size_t(((s >> 6) + 1) * steps[0] + ((s >> 3 & 7) + 1) * steps[1] + (s & 7) + 1)];
            bool is_possible = true;
            for (int corner = 0; is_possible && corner < 4; ++corner) {
                const int at = (corner >> 1) * steps[1] + (corner & 1), opposite = steps[0] + steps[1] + 1 - at;
                is_possible = square(here[at]) + square(here[opposite]) <= 3;
            }
            if (is_possible) return true;
        }
    }
    return false;
}

namespace {

using volume::kInside;
using volume::kSamples;
using volume::kSide;

// Brick coordinates of a row.
std::array<int, 3> brick_of(const volume::Layout& layout, size_t row) {
    const int32_t* ijk = layout.ijk + 3 * row;
    return {ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3};
}

// Elements of a forest: 0 is the space beyond the samples, then come the samples, then the unsampled bricks.
template <class Index, class Value>
class Elements {
  public:
    Elements(const volume::Layout& layout, const Value* values, std::span<Index> parent)
        : layout_(layout), values_(values), parent_(parent), sets_(parent), tile_(size_t(layout.size[0]) * size_t(layout.size[1]) * size_t(layout.size[2])) {
        Index next = Index(1 + layout.count * kSamples);
        for (size_t b = 0; b < tile_.size(); ++b) tile_[b] = layout.index[b] < 0 ? next++ : 0;
    }

    // Unites unsampled bricks of the same side that have a face in common.
    void unite_tiles() {
        const auto [nx, ny, nz] = layout_.size;
        for (int x = 0; x <= nx; ++x)
            for (int y = 0; y <= ny; ++y)
                for (int z = 0; z <= nz; ++z) {
                    const int32_t here = layout_.at(x, y, z);
                    if (here >= 0) continue;
                    for (const auto& [u, v, w] : {std::array{x - 1, y, z}, std::array{x, y - 1, z}, std::array{x, y, z - 1}}) {
                        if (layout_.at(u, v, w) == here) sets_.unite(tile(x, y, z), tile(u, v, w));
                    }
                }
    }

    // Unites the samples of a brick with those beside them, and with unsampled bricks.
    void unite_samples(size_t row) {
        const auto brick = brick_of(layout_, row);
        const Value* f = values_ + row * kSamples;
        for (int axis = 2; axis >= 0; --axis) {
            const int shift = 6 - 3 * axis;
            auto before = brick, behind = brick;
            --before[size_t(axis)], ++behind[size_t(axis)];
            const int32_t previous = layout_.at(before[0], before[1], before[2]), next = layout_.at(behind[0], behind[1], behind[2]);
            const Index first = tile(before[0], before[1], before[2]), last = tile(behind[0], behind[1], behind[2]);
            for (int s = 0; s < kSamples; ++s) {
                const bool here = f[s] < 0;
                const Index element = sample(row, s);
                const int at = s >> shift & 7;
                if (at < kSide - 1) {
                    unite_like(here, element, f[s + (1 << shift)] < 0, element + (1 << shift));
                } else if (next >= 0) {
                    const int t = s - (7 << shift);
                    unite_like(here, element, values_[size_t(next) * kSamples + size_t(t)] < 0, sample(size_t(next), t));
                } else {
                    unite_like(here, element, next == kInside, last);
                }
                if (at == 0 && previous < 0) unite_like(here, element, previous == kInside, first);
            }
        }
    }

    Index number() { return sets_.number(); }

  private:
    static Index sample(size_t row, int s) { return Index(1 + row * kSamples + size_t(s)); }
    Index tile(int x, int y, int z) const {
        const auto [nx, ny, nz] = layout_.size;
        const bool within = x >= 0 && y >= 0 && z >= 0 && x < nx && y < ny && z < nz;
        return within ? tile_[(size_t(x) * size_t(ny) + size_t(y)) * size_t(nz) + size_t(z)] : 0;
    }
    void unite_like(bool side, Index element, bool other_side, Index other) {
        if (side == other_side && parent_[size_t(element)] != parent_[size_t(other)]) sets_.unite(element, other);
    }

    const volume::Layout& layout_;
    const Value* values_;
    std::span<const Index> parent_;
    DisjointSets<Index> sets_;
    std::vector<Index> tile_;  // element of each unsampled brick
};

}  // namespace

template <class Index, class Value>
SolidComponents<Index> solid_components(const volume::Layout& layout, const Value* values) {
    const size_t bricks = size_t(layout.size[0]) * size_t(layout.size[1]) * size_t(layout.size[2]);
    const size_t samples = layout.count * kSamples;
    SolidComponents<Index> result{{1 + samples + bricks - layout.count, 1}, {}, {}};
    std::span<Index> of(result.of.data.get(), result.of.rows);
    std::iota(of.begin(), of.end(), Index(0));
    Elements<Index, Value> elements(layout, values, of);
    elements.unite_tiles();
    for (size_t row = 0; row < layout.count; ++row) elements.unite_samples(row);
    const size_t count = size_t(elements.number());
    result.sizes.resize(count);
    result.inside.resize(count);
    auto add = [&](size_t element, int64_t size, bool inside) {
        const size_t component = size_t(of[element]);
        result.sizes[component] += size;
        result.inside[component] = inside;
    };
    for (size_t s = 0; s < samples; ++s) add(1 + s, 1, values[s] < 0);
    for (size_t b = 0, element = 1 + samples; b < bricks; ++b) {
        if (layout.index[b] < 0) add(element++, kSamples, layout.index[b] == kInside);
    }
    return result;
}

template <class Index, class Value>
std::vector<int64_t> crossings_by_component(const volume::Layout& layout, const Value* values, const Index* labels, size_t count) {
    std::vector<int64_t> crossings(count);
    for (size_t row = 0; row < layout.count; ++row) {
        for (int axis = 0; axis < 3; ++axis) {
            auto behind = brick_of(layout, row);
            ++behind[size_t(axis)];
            const int32_t next = layout.at(behind[0], behind[1], behind[2]);
            const int shift = 6 - 3 * axis;
            for (int s = 0; s < kSamples; ++s) {
                const bool is_last = (s >> shift & 7) == kSide - 1;
                if (is_last && next < 0) continue;
                const size_t here = row * kSamples + size_t(s);
                const size_t there = is_last ? size_t(next) * kSamples + size_t(s - (7 << shift)) : here + (size_t(1) << shift);
                if ((values[here] < 0) != (values[there] < 0)) ++crossings[size_t(labels[values[here] < 0 ? here : there])];
            }
        }
    }
    return crossings;
}

#define FRACSLICE_COMPONENTS(Index, Value)                                                                  \
    template SolidComponents<Index> solid_components<Index, Value>(const volume::Layout&, const Value*);    \
    template std::vector<int64_t> crossings_by_component<Index, Value>(const volume::Layout&, const Value*, \
                                                                       const Index*, size_t);
FRACSLICE_COMPONENTS(int32_t, float)
FRACSLICE_COMPONENTS(int32_t, int8_t)
FRACSLICE_COMPONENTS(int64_t, float)
FRACSLICE_COMPONENTS(int64_t, int8_t)

namespace {

using volume::kSamples;

constexpr uint8_t kFar = 255;

// The sample one step along an axis, or a row below 0 if it is in no sampled brick.
struct Sample {
    int32_t row;
    int s;
};

Sample stepped(const volume::Layout& layout, Sample from, int axis, int sign) {
    const int shift = 6 - 3 * axis, at = from.s >> shift & 7;
    if (at + sign >= 0 && at + sign < volume::kSide) return {from.row, from.s + sign * (1 << shift)};
    const int32_t* ijk = layout.ijk + 3 * size_t(from.row);
    std::array<int, 3> brick{ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3};
    brick[size_t(axis)] += sign;
    return {layout.at(brick[0], brick[1], brick[2]), from.s - sign * (7 << shift)};
}

}  // namespace

std::vector<uint8_t> bricks_near(std::span<const Place> points, double reach, const std::array<int, 3>& shape) {
    std::vector<uint8_t> near(size_t(shape[0]) * size_t(shape[1]) * size_t(shape[2]));
    for (const auto& [x, y, z] : points) {
        for (int i = int(x - reach) >> 3; i <= int(x + reach) >> 3; ++i)
            for (int j = int(y - reach) >> 3; j <= int(y + reach) >> 3; ++j)
                for (int k = int(z - reach) >> 3; k <= int(z + reach) >> 3; ++k) {
                    near[(size_t(i) * size_t(shape[1]) + size_t(j)) * size_t(shape[2]) + size_t(k)] = 1;
                }
    }
    return near;
}

void lower_squares(std::span<const Line> lines, std::span<const Place> points, std::span<const int32_t> of, double reach,
                   const volume::Layout& layout, float* squares) {
    const double far = reach + 0.5;  // a sample within reach of a capsule is as near to one of its points
    for (size_t m = 0; m < points.size(); ++m) {
        const auto [x, y, z] = points[m];
        const Line& line = lines[size_t(of[m])];
        const double a = line[3], b = line[4], c = line[5], inverse = line[6];
        for (int i = int(std::ceil(x - far)); i <= int(x + far); ++i)
            for (int j = int(std::ceil(y - far)); j <= int(y + far); ++j) {
                const double u = i - line[0], v = j - line[1];
                const double left = far * far - (i - x) * (i - x) - (j - y) * (j - y);
                if (left < 0) continue;
                for (int k = int(std::ceil(z - std::sqrt(left))); k <= int(z + std::sqrt(left)); ++k) {
                    const double w = k - line[2];
                    const double t = std::min(std::max((u * a + v * b + w * c) * inverse, 0.0), 1.0);
                    const double dx = u - t * a, dy = v - t * b, dz = w - t * c;
                    const int32_t row = layout.at(i >> 3, j >> 3, k >> 3);
                    if (row < 0) continue;  // in the half voxel beyond reach
                    float& square = squares[size_t(row) * kSamples + size_t((i & 7) << 6 | (j & 7) << 3 | (k & 7))];
                    square = std::min(square, float(dx * dx + dy * dy + dz * dz));
                }
            }
    }
}

std::vector<uint8_t> steps_to(const volume::Layout& layout, const bool* seeds) {
    const size_t samples = layout.count * kSamples;
    std::vector<uint8_t> steps(samples, kFar);
    std::vector<Sample> queue;
    for (size_t n = 0; n < samples; ++n) {
        if (!seeds[n]) continue;
        steps[n] = 0;
        queue.push_back({int32_t(n / kSamples), int(n % kSamples)});
    }
    auto of = [&](const Sample& sample) -> uint8_t& { return steps[size_t(sample.row) * kSamples + size_t(sample.s)]; };
    for (size_t first = 0; first < queue.size(); ++first) {
        const Sample here = queue[first];
        const int next = of(here) + 1;
        if (next == kFar) continue;
        for (int axis = 0; axis < 3; ++axis) {
            for (int sign : {-1, 1}) {
                const Sample there = stepped(layout, here, axis, sign);
                if (there.row < 0 || of(there) != kFar) continue;
                of(there) = uint8_t(next);
                queue.push_back(there);
            }
        }
    }
    return steps;
}

}  // namespace fracslice::printing
