#include "extent.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fracslice::volume {
namespace {

constexpr int kRounds = 256;  // at most
constexpr size_t kBlock = 2 * kPointsAtOnce;

void evaluate(const FieldValues& field, Points& points) {
    const size_t n = points.size();
    points.f.resize(n);
    tbb::parallel_for(size_t(0), (n + kBlock - 1) / kBlock, [&](size_t k) {
        const size_t i = k * kBlock;
        field({&points.x[i], &points.y[i], &points.z[i], &points.f[i]}, std::min(kBlock, n - i));
    });
}

}  // namespace

void climb(const FieldValues& field, const std::array<double*, 3>& points, size_t directions, size_t starts, const Steps& steps,
           double first, double exact) {
    std::vector<double> step(directions, first);
    std::vector<size_t> going(directions);
    std::iota(going.begin(), going.end(), size_t(0));
    Points tried;
    for (int round = 0; round < kRounds && !going.empty() && starts; ++round) {
        tried.clear();
        for (size_t d : going) {
            const size_t first_step = d * steps.count;
            for (size_t i = d * starts; i < (d + 1) * starts; ++i) {
                for (size_t w = first_step; w < first_step + steps.count; ++w) {
                    tried.push({points[0][i] + step[d] * steps.x[w], points[1][i] + step[d] * steps.y[w],
                                points[2][i] + step[d] * steps.z[w]});
                }
            }
        }
        evaluate(field, tried);
        std::vector<size_t> left;
        size_t here = 0;
        for (size_t d : going) {
            bool moved = false;
            for (size_t i = d * starts; i < (d + 1) * starts; ++i, here += steps.count) {
                size_t best = 0;
                double gain = 0;
                for (size_t w = 0; w < steps.count; ++w) {
                    if (tried.f[here + w] < 0 && steps.gain[w] > gain) best = w, gain = steps.gain[w];
                }
                if (gain > 0) {
                    const auto to = tried[here + best];
                    for (size_t k = 0; k < 3; ++k) points[k][i] = to[k];
                    moved = true;
                }
            }
            if (moved || !(step[d] < exact)) left.push_back(d);
            if (!moved) step[d] /= 2;
        }
        going = std::move(left);
    }
}

namespace {

constexpr size_t kColumns = 32;            // initial ones along each axis
constexpr double kNarrowest = 1.0 / 65536;  // smallest width: the field is zero there, but not below
constexpr size_t kFront = size_t(1) << 13;  // about as many columns are processed together
constexpr double kDepths[] = {2, 8};        // below a ceiling, in radii of the column: probed for interior points
constexpr size_t kProbes = 64;              // columns whose segment up to the ceiling is probed
constexpr int kSteps = 16;                  // of such a segment
constexpr double kRounding = 4 * double(std::numeric_limits<float>::epsilon());  // of a distance, by the largest coordinate
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// NaN comes last.
bool before(double a, double b) { return a < b || (std::isnan(b) && !std::isnan(a)); }

}  // namespace

Side::Side(const Point& lo, const Point& hi, int axis, int sign) : axis_(axis), sign_(sign), lo_(lo), hi_(hi) {
    best_.fill({NAN, NAN, NAN});
    floor_ = std::min(sign * lo[axis], sign * hi[axis]);
    above_ = std::max(sign * lo[axis], sign * hi[axis]);
    longest_ = std::max({hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]});
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    half_ = {(hi[a] - lo[a]) / kColumns / 2, (hi[b] - lo[b]) / kColumns / 2};
    radius_ = std::hypot(half_[0], half_[1]);
    for (size_t i = 0; i < kColumns * kColumns; ++i) {
        columns_.push(lo[a] + half_[0] * double(2 * (i / kColumns) + 1), lo[b] + half_[1] * double(2 * (i % kColumns) + 1), 1,
                      above_);
    }
}

void Side::learn(const Point& point) {
    const double key = -sign_ * point[axis_];
    size_t k = 0;
    while (k < kBest && !before(key, -sign_ * best_[k][axis_])) ++k;  // behind equal ones
    if (k < kBest) {
        std::move_backward(best_.begin() + k, best_.end() - 1, best_.end());
        best_[k] = point;
    }
    const double height = sign_ * best_[0][axis_];
    known_ = std::isnan(height) ? -kInfinite : height;
}

void Side::guess(const FreeSpace& field, double share, double aim, size_t most) {
    const FreeSpace bold{field.sign, field.conservative, share * field.lipschitz, field.far};
    Side other(lo_, hi_, axis_, sign_);
    for (int k = 0; k < 2; ++k) {  // twice, so that the two highest are the starts of the next climb
        for (const Point& p : best_) other.learn(p);
    }
    other.prove(bold, aim, most);
    best_ = other.best_;
}

void Side::prove(const FreeSpace& field, double aim, size_t most) {
    std::vector<double> tops;
    while (spent_ < most) {
        Columns left, front;
        tops.clear();
        const double least = std::max(known_, floor_);
        auto waits = [&](size_t i) { return high(columns_.top[i], aim) && columns_.width[i] > kNarrowest; };
        for (size_t i = 0; i < columns_.size(); ++i) {
            if (columns_.top[i] > least && waits(i)) tops.push_back(columns_.top[i]);
        }
        double lowest = -kInfinite;
        if (tops.size() > kFront) {
            const auto rank = tops.end() - kFront;
            std::nth_element(tops.begin(), rank, tops.end());
            lowest = *rank;
        }
        for (size_t i = 0; i < columns_.size(); ++i) {
            if (columns_.top[i] <= least) continue;
            (waits(i) && columns_.top[i] >= lowest ? front : left).push(columns_, i);
        }
        columns_ = std::move(left);
        if (!front.size()) break;
        lower(field, front, aim);
    }
    above_ = std::max(known_, floor_);
    for (double top : columns_.top) above_ = std::max(above_, top);
}

Point Side::point(double u, double v, double height) const {
    Point result;
    result[(axis_ + 1) % 3] = u, result[(axis_ + 2) % 3] = v, result[axis_] = sign_ * height;
    return result;
}

// Whether a ceiling is to be lowered.
bool Side::high(double ceiling, double aim) const { return ceiling > std::max(known_ + aim, floor_); }

// Lowers the ceilings of columns, and splits in four those not lowered much.
void Side::lower(const FreeSpace& field, const Columns& front, double aim) {
    const size_t n = front.size();
    spent_ += n;
    std::vector<double> lower = front.top;
    drop(field, front, front.top, lower);
    if (field.far && std::isfinite(known_)) {
        // From this height, a ball that spans the column comes within `aim` of a flat face.
        std::vector<double> heights(n);
        for (size_t i = 0; i < n; ++i) {
            const double r = radius(front.width[i]);
            heights[i] = known_ + std::min(std::max(r * r / aim, front.top[i] - known_), longest_ / 2);
        }
        drop(field, front, heights, lower);
    }
    Columns stuck;
    for (size_t i = 0; i < n; ++i) {
        const bool splits = front.top[i] - lower[i] < radius(front.width[i]) / 2 && high(lower[i], aim);
        (splits ? stuck : columns_).push(front.u[i], front.v[i], front.width[i], lower[i]);
    }
    probe(field, stuck);
    for (size_t i = 0; i < stuck.size(); ++i) {
        for (double a : {-0.5, 0.5}) {
            for (double b : {-0.5, 0.5}) {
                columns_.push(stuck.u[i] + a * half_[0] * stuck.width[i], stuck.v[i] + b * half_[1] * stuck.width[i],
                              stuck.width[i] / 2, stuck.top[i]);
            }
        }
    }
}

// Lowers to where free balls around some heights empty the columns that they span.
void Side::drop(const FreeSpace& field, const Columns& front, const std::vector<double>& heights, std::vector<double>& lower) {
    points_.clear();
    double largest = 0;
    for (size_t i = 0; i < front.size(); ++i) {
        const Point p = point(front.u[i], front.v[i], heights[i]);
        for (double x : p) largest = std::max(largest, std::abs(x));
        points_.push(p);
    }
    points_.evaluate(field.conservative);
    for (size_t i = 0; i < front.size(); ++i) {
        const double f = points_.f[i], free = f > 0 ? f / field.lipschitz - kRounding * largest : 0;
        const double r = radius(front.width[i]);
        if (free > r) lower[i] = std::min(lower[i], heights[i] - std::sqrt(std::max(free * free - r * r, 0.0)));
    }
}

// Searches for interior points slightly below the ceilings; from the highest ones found, up to the ceilings too.
void Side::probe(const FreeSpace& field, const Columns& stuck) {
    for (double depth : kDepths) {
        points_.clear();
        auto deep = [&](size_t i) { return stuck.top[i] - depth * radius(stuck.width[i]); };
        for (size_t i = 0; i < stuck.size(); ++i) points_.push(point(stuck.u[i], stuck.v[i], deep(i)));
        points_.evaluate(field.sign);
        std::vector<size_t> inside;
        for (size_t i = 0; i < stuck.size(); ++i) {
            if (points_.f[i] < 0 && deep(i) > known_) inside.push_back(i);
        }
        for (size_t i : inside) learn(points_[i]);
        std::stable_sort(inside.begin(), inside.end(), [&](size_t i, size_t j) { return stuck.top[i] > stuck.top[j]; });
        inside.resize(std::min(inside.size(), kProbes));
        points_.clear();
        for (int step = 1; step < kSteps; ++step) {
            for (size_t i : inside) {
                const double height = stuck.top[i] - depth * radius(stuck.width[i]) * (double(step) / kSteps);
                points_.push(point(stuck.u[i], stuck.v[i], height));
            }
        }
        points_.evaluate(field.sign);
        for (size_t i = 0; i < points_.size(); ++i) {
            if (points_.f[i] < 0) learn(points_[i]);
        }
    }
}

namespace {

// |f| in voxels above which a difference of one is flat.
constexpr double kFlat = 1e-5;

double norm(const std::array<double, 3>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// Some points and the field there, in rows.
struct Block {
    double p[3][kPointsAtOnce], f[kPointsAtOnce], there[kPointsAtOnce];
    std::array<double, 3> up[kPointsAtOnce];  // slopes along the axes
    double steep[kPointsAtOnce];
    size_t number[kPointsAtOnce];  // of the point in its whole block
    size_t count = 0;

    // Slopes of all points along a step, in `there`.
    void differ(const FieldValues& field, const Differences& by, size_t which) {
        double moved[3][kPointsAtOnce];
        for (size_t k = 0; k < 3; ++k) {
            for (size_t i = 0; i < count; ++i) moved[k][i] = p[k][i] + by.steps[3 * which + k];
        }
        field({moved[0], moved[1], moved[2], there}, count);
        for (size_t i = 0; i < count; ++i) there[i] = std::abs(there[i] - f[i]) / by.length;
    }

    // Keeps the points that are flat.
    void keep_flat(double voxel) {
        size_t kept = 0;
        for (size_t i = 0; i < count; ++i) {
            if (!(std::abs(f[i]) > kFlat * voxel * steep[i])) continue;
            for (auto& row : p) row[kept] = row[i];
            f[kept] = f[i], up[kept] = up[i], steep[kept] = steep[i], number[kept] = number[i];
            ++kept;
        }
        count = kept;
    }

    void measure(double voxel, double* errors) const {
        for (size_t i = 0; i < count; ++i) {
            errors[number[i]] = std::min(std::abs(f[i]) / std::max(steep[i], 1e-30), voxel);
        }
    }
};

void measure(const FieldValues& field, const PlacedPoints& points, const Differences& by, double voxel, size_t first, size_t last,
             double* errors) {
    Block block;
    block.count = last - first;
    for (size_t i = 0; i < block.count; ++i) {
        block.number[i] = first + i;
        for (size_t k = 0; k < 3; ++k) block.p[k][i] = points.at(first + i, k);
    }
    field({block.p[0], block.p[1], block.p[2], block.f}, block.count);
    for (size_t k = 0; k < 3; ++k) {
        block.differ(field, by, k);
        for (size_t i = 0; i < block.count; ++i) block.up[i][k] = block.there[i];
    }
    for (size_t i = 0; i < block.count; ++i) block.steep[i] = norm(block.up[i]);
    block.measure(voxel, errors);
    block.keep_flat(voxel);
    if (!block.count) return;
    for (size_t k = 0; k < 3; ++k) {
        block.differ(field, by, 3 + k);
        for (size_t i = 0; i < block.count; ++i) block.up[i][k] = std::max(block.up[i][k], block.there[i]);
    }
    for (size_t i = 0; i < block.count; ++i) block.steep[i] = norm(block.up[i]);
    block.measure(voxel, errors);
    block.keep_flat(voxel);
    for (size_t k = 6; k < 26 && block.count; ++k) {
        block.differ(field, by, k);
        for (size_t i = 0; i < block.count; ++i) block.steep[i] = std::max(block.steep[i], block.there[i]);
    }
    block.measure(voxel, errors);
}

}  // namespace

void surface_error(const FieldValues& field, const PlacedPoints& points, const Differences& differences, double voxel,
                   std::span<double> errors) {
    const size_t blocks = (errors.size() + kPointsAtOnce - 1) / kPointsAtOnce;
    tbb::parallel_for(size_t(0), blocks, [&](size_t k) {
        const size_t first = k * kPointsAtOnce, last = std::min(errors.size(), first + kPointsAtOnce);
        measure(field, points, differences, voxel, first, last, errors.data());
    });
}

}  // namespace fracslice::volume
