#include "level_set.h"

#pragma GCC visibility push(default)
#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tree/LeafManager.h>
#pragma GCC visibility pop

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fracslice::volume {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;

constexpr size_t kPoints = 8;  // in a leaf, at most
constexpr size_t kApart = 1 << 14;  // points that are worth a thread

Vec3d gradient(const FloatGrid::ConstAccessor& at, const Coord& p) {
    Vec3d g;
    for (int k = 0; k < 3; ++k) {
        Coord step(0);
        step[k] = 1;
        g[k] = double(at.getValue(p + step)) - double(at.getValue(p - step));
    }
    return g;
}

// Crossings of the edge from a sample to the next one along an axis.
void cross(const FloatGrid::ConstAccessor& at, const Coord& p, int axis, std::vector<SurfacePoint>& points) {
    Coord next = p;
    ++next[axis];
    const double a = at.getValue(p), b = at.getValue(next);
    if ((a < 0) == (b < 0)) return;
    const double t = a / (a - b);
    Vec3d up = (1 - t) * gradient(at, p) + t * gradient(at, next), q = p.asVec3d();
    q[axis] += t;
    if (!up.normalize()) up.setZero();
    points.push_back({q, up});
}

// Crossings of edges that begin in a leaf, or end there and begin in none.
std::vector<SurfacePoint> crossings(const FloatGrid::TreeType& tree, const FloatGrid::TreeType::LeafNodeType& leaf) {
    std::vector<SurfacePoint> points;
    FloatGrid::ConstAccessor at(tree);
    for (openvdb::Index n = 0; n < leaf.SIZE; ++n) {
        const Coord local = leaf.offsetToLocalCoord(n), p = local + leaf.origin();
        for (int axis = 0; axis < 3; ++axis) {
            cross(at, p, axis, points);
            Coord before = p;
            --before[axis];
            if (local[axis] == 0 && !tree.probeConstLeaf(before)) cross(at, before, axis, points);
        }
    }
    return points;
}

}  // namespace

SurfacePoints::SurfacePoints(const FloatGrid::TreeType& tree) {
    const auto leaves = sorted_leaves(tree);
    std::vector<std::vector<SurfacePoint>> found(leaves.size());
    tbb::parallel_for(size_t(0), leaves.size(), [&](size_t k) { found[k] = crossings(tree, *leaves[k]); });
    for (auto& some : found) points_.insert(points_.end(), some.begin(), some.end());
    while (leaves_ * kPoints < points_.size()) leaves_ *= 2;
    boxes_.resize(2 * leaves_), first_.assign(leaves_ + 1, points_.size());
    halve(1, points_);
}

void SurfacePoints::halve(size_t node, std::span<SurfacePoint> points) {
    constexpr double far = std::numeric_limits<double>::infinity();
    Box box{Vec3d(far), Vec3d(-far)};
    for (const SurfacePoint& point : points) {
        box.low = openvdb::math::minComponent(box.low, point.at);
        box.high = openvdb::math::maxComponent(box.high, point.at);
    }
    boxes_[node] = box;
    if (node >= leaves_) {
        first_[node - leaves_] = size_t(points.data() - points_.data());
        return;
    }
    const size_t axis = openvdb::math::MaxIndex(box.high - box.low), half = points.size() / 2;
    std::nth_element(points.begin(), points.begin() + ptrdiff_t(half), points.end(),
                     [axis](const SurfacePoint& a, const SurfacePoint& b) { return a.at[int(axis)] < b.at[int(axis)]; });
    const auto left = [&] { halve(2 * node, points.first(half)); };
    const auto right = [&] { halve(2 * node + 1, points.subspan(half)); };
    if (points.size() > kApart) {
        tbb::parallel_invoke(left, right);
    } else {
        left(), right();
    }
}

size_t SurfacePoints::nearest(const Vec3d& q, size_t guess) const {
    if (guess >= points_.size()) guess = 0;
    size_t best = guess;
    double least = (points_[guess].at - q).lengthSqr();
    const auto away = [&](size_t node) {
        const Box& box = boxes_[node];
        double square = 0;
        for (int k = 0; k < 3; ++k) {
            const double x = std::max({0.0, box.low[k] - q[k], q[k] - box.high[k]});
            square += x * x;
        }
        return square;
    };
    struct Open {
        size_t node;
        double square;
    } open[128] = {{1, 0}};
    for (int height = 1; height > 0;) {
        const auto [node, square] = open[--height];
        if (square > least) continue;
        if (node >= leaves_) {
            for (size_t i = first_[node - leaves_]; i < first_[node - leaves_ + 1]; ++i) {
                const double there = (points_[i].at - q).lengthSqr();
                if (there < least || (there == least && i < best)) least = there, best = i;
            }
            continue;
        }
        Open left{2 * node, away(2 * node)}, right{2 * node + 1, away(2 * node + 1)};
        if (left.square < right.square) std::swap(left, right);
        open[height++] = left, open[height++] = right;
    }
    return best;
}

namespace {

using Tree = FloatGrid::TreeType;
using Leaf = Tree::LeafNodeType;

constexpr double kWidest = 4;             // voxels: samples farther from the surface are not kept
constexpr double kFlattest = 0.5, kSteepest = 2;  // of what is taken for distances
constexpr double kAside = 0.7;            // how far from its foot on the surface the nearest crossing can be, voxels
constexpr size_t kMeasured = 1 << 18;     // samples that are compared, at most
constexpr double kMargin = 1.25;          // of what is measured at samples
constexpr double kFar = 1 << 30;          // voxels: no sample is there

template <class Value>
double largest(size_t n, const Value& value) {
    return tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, n), 0.0,
        [&](const tbb::blocked_range<size_t>& range, double most) {
            for (size_t i = range.begin(); i < range.end(); ++i) most = std::max(most, value(i));
            return most;
        },
        [](double a, double b) { return std::max(a, b); });
}

// The steepest slope of a cell, between eight values; it is at a corner, as the square of the slope is convex along each axis.
double steepest(const std::array<float, 8>& v) {
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
        double square = 0;
        for (int k = 0; k < 3; ++k) {
            const double rise = double(v[size_t(corner | 1 << k)]) - double(v[size_t(corner & ~(1 << k))]);
            square += rise * rise;
        }
        most = std::max(most, square);
    }
    return std::sqrt(most);
}

// The steepest slope of cells at a leaf with a value below `most`, per voxel.
double steepest(const Tree& tree, const Leaf& leaf, double most) {
    constexpr int n = kSide + 2;
    std::array<float, n * n * n> values;
    FloatGrid::ConstAccessor at(tree);
    const auto place = [](int x, int y, int z) { return size_t((x * n + y) * n + z); };
    for (int x = 0; x < n; ++x) {
        for (int y = 0; y < n; ++y) {
            for (int z = 0; z < n; ++z) values[place(x, y, z)] = at.getValue(leaf.origin() + Coord(x - 1, y - 1, z - 1));
        }
    }
    double found = 0;
    for (int x = 0; x + 1 < n; ++x) {
        for (int y = 0; y + 1 < n; ++y) {
            for (int z = 0; z + 1 < n; ++z) {
                std::array<float, 8> v;
                double nearest = std::numeric_limits<double>::infinity();
                for (int k = 0; k < 8; ++k) {
                    v[size_t(k)] = values[place(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2))];
                    nearest = std::min(nearest, std::abs(double(v[size_t(k)])));
                }
                if (nearest < most) found = std::max(found, steepest(v));
            }
        }
    }
    return found;
}

void require_numbers(const Tree& tree) {
    bool finite = std::isfinite(tree.background());
    for (auto value = tree.cbeginValueAll(); value && finite; ++value) finite = std::isfinite(*value);
    if (!finite) throw std::invalid_argument("holds samples that are not finite numbers");
}

// Between tiles of both signs there is no sample, and no surface.
void require_closed(const Tree& tree) {
    if (!(tree.background() > 0)) throw std::invalid_argument("has its inside everywhere beyond its samples");
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(int(Tree::DEPTH) - 2);
    for (; tile; ++tile) {
        if (!(*tile < 0)) continue;
        const openvdb::CoordBBox box = tile.getBoundingBox();
        for (int axis = 0; axis < 3; ++axis) {
            for (int side = 0; side < 2; ++side) {
                openvdb::CoordBBox face = box;
                const int at = side ? box.max()[axis] + 1 : box.min()[axis] - 1;
                face.min()[axis] = face.max()[axis] = at;
                Coord p = face.min();
                for (p[0] = face.min()[0]; p[0] <= face.max()[0]; p[0] += kSide) {
                    for (p[1] = face.min()[1]; p[1] <= face.max()[1]; p[1] += kSide) {
                        for (p[2] = face.min()[2]; p[2] <= face.max()[2]; p[2] += kSide) {
                            if (tree.getValue(p) >= 0 && !tree.probeConstLeaf(p)) {
                                throw std::invalid_argument("has an inside without closure: no samples around it");
                            }
                        }
                    }
                }
            }
        }
    }
}

// The edge's first sample and the next; along an axis on which the point is at a sample both are the same.
openvdb::BoolTree::Ptr samples_beside(const SurfacePoints& points) {
    auto mask = std::make_shared<openvdb::BoolTree>(false);
    openvdb::tree::ValueAccessor<openvdb::BoolTree> at(*mask);
    for (const SurfacePoint& point : points.all()) {
        at.setValueOn(Coord::floor(point.at)), at.setValueOn(Coord::ceil(point.at));
    }
    return mask;
}

// About the distance of a sample, voxels: near the surface that of the plane at the nearest crossing, past its edge and from
// two voxels on that of the crossing, to which `LevelSet` goes over.
double distance(const Vec3d& q, const SurfacePoint& nearest) {
    const Vec3d away = q - nearest.at;
    const double straight = away.length();
    if (nearest.up.isZero()) return straight;
    const double over = away.dot(nearest.up);
    const double aside = std::max(0.0, std::sqrt(std::max(0.0, straight * straight - over * over)) - kAside);
    return std::lerp(std::sqrt(over * over + aside * aside), straight, std::clamp(straight - 1, 0.0, 1.0));
}

// Leaves out what is farther from the surface than a width.
void trim(FloatGrid& grid, float width) {
    if (!(grid.background() > width)) return;
    openvdb::tree::LeafManager<Tree> leaves(grid.tree());
    leaves.foreach([width](Leaf& leaf, size_t) {
        for (openvdb::Index n = 0; n < leaf.SIZE; ++n) {
            const float value = leaf.getValue(n);
            if (std::abs(value) < width) continue;
            leaf.setValueOff(n, std::copysign(width, value));
        }
    });
    grid.tree().root().setBackground(width, false);
    for (auto tile = grid.tree().beginValueAll(); tile; ++tile) {
        if (std::abs(*tile) > width) tile.setValue(std::copysign(width, *tile));
    }
    openvdb::tools::pruneLevelSet(grid.tree());
}

// The value up to which those between samples are linear.
double end_of_linear(const FloatGrid& grid) { return std::min(2 * grid.voxelSize()[0], 0.9 * double(grid.background())); }

// The steepest slope where linear values count.
double slope(const FloatGrid& grid, double end) {
    const auto leaves = sorted_leaves(grid.tree());
    return largest(leaves.size(), [&](size_t k) { return steepest(grid.tree(), *leaves[k], end); }) / grid.voxelSize()[0];
}

}  // namespace

FloatGrid::Ptr narrow_band(const FloatGrid& grid) {
    require_numbers(grid.tree());
    require_closed(grid.tree());
    const SurfacePoints points(grid.tree());
    if (points.all().empty()) throw std::invalid_argument("holds no surface");
    const double voxel = grid.voxelSize()[0];
    const float width = float(kBand * voxel);
    const auto mask = samples_beside(points);
    openvdb::tools::dilateActiveValues(*mask, int(kBand) + 1, openvdb::tools::NN_FACE_EDGE_VERTEX);
    mask->voxelizeActiveTiles();  // which full leaves have become
    auto made = FloatGrid::create(std::make_shared<Tree>(*mask, width, openvdb::TopologyCopy()));
    openvdb::tree::LeafManager<Tree> leaves(made->tree());
    leaves.foreach([&](Leaf& leaf, size_t) {
        FloatGrid::ConstAccessor at(grid.tree());
        size_t found = 0;
        for (openvdb::Index n = 0; n < leaf.SIZE; ++n) {
            const Coord p = leaf.offsetToGlobalCoord(n);
            const float sign = at.getValue(p) < 0 ? -1.f : 1.f;
            float away = width;
            if (leaf.isValueOn(n)) {
                found = points.nearest(p.asVec3d(), found);
                away = float(voxel * distance(p.asVec3d(), points.all()[found]));
            }
            if (away < width) {
                leaf.setValueOnly(n, sign * away);
            } else {
                leaf.setValueOff(n, sign * width);
            }
        }
    });
    openvdb::tools::signedFloodFillWithValues(made->tree(), width, -width);
    openvdb::tools::pruneLevelSet(made->tree());
    made->setTransform(grid.transform().copy());
    made->setGridClass(openvdb::GRID_LEVEL_SET);
    made->setName(grid.getName());
    return made;
}

FloatGrid::Ptr level_set_of(const FloatGrid& grid) {
    require_numbers(grid.tree());
    require_closed(grid.tree());
    const double found = slope(grid, end_of_linear(grid));
    if (!(kFlattest <= found && found <= kSteepest)) return narrow_band(grid);
    auto made = grid.deepCopy();
    trim(*made, float(kWidest * grid.voxelSize()[0]));
    made->setGridClass(openvdb::GRID_LEVEL_SET);
    return made;
}

LevelSet::LevelSet(const FloatGrid& grid)
    : grid_(level_set_of(grid)), voxel_(grid_->voxelSize()[0]), end_(end_of_linear(*grid_)), begin_(end_ / 2), points_(grid_->tree()),
      entry_(mesh::entry_of(this)) {
    if (points_.all().empty()) throw std::invalid_argument("holds no surface");
    const double own = slope(*grid_, end_);
    steepness_ = std::max(own, 1.0) + kMargin * own * disagreement();
}

// How much steeper values can be where they pass into distances to points.
double LevelSet::disagreement() const {
    std::vector<std::pair<Coord, double>> samples;
    for (const Leaf* leaf : sorted_leaves(grid_->tree())) {
        for (openvdb::Index n = 0; n < leaf->SIZE; ++n) {
            const double value = std::abs(double(leaf->getValue(n)));
            if (begin_ <= value && value <= end_) samples.emplace_back(leaf->offsetToGlobalCoord(n), value);
        }
    }
    const size_t step = samples.size() / kMeasured + 1;
    return largest(samples.size() / step, [&](size_t k) {
        const auto& [p, value] = samples[k * step];
        const Vec3d q = p.asVec3d();
        return std::abs(voxel_ * (points_.all()[points_.nearest(q)].at - q).length() - value) / (end_ - begin_);
    });
}

double LevelSet::linear(const Vec3d& q) const {
    const Tree& tree = grid_->tree();
    for (int k = 0; k < 3; ++k) {
        if (!(std::abs(q[k]) < kFar)) return tree.background();
    }
    const Coord cell = Coord::floor(q);
    const Leaf* leaf = tree.probeConstLeaf(cell);
    const Coord local = cell & (kSide - 1);
    std::array<double, 8> v;
    if (leaf && local[0] < kSide - 1 && local[1] < kSide - 1 && local[2] < kSide - 1) {
        const float* at = leaf->buffer().data() + Leaf::coordToOffset(cell);
        for (size_t k = 0; k < 8; ++k) v[k] = at[(k & 1) * 64 + (k >> 1 & 1) * 8 + (k >> 2)];
    } else {
        for (int k = 0; k < 8; ++k) v[size_t(k)] = tree.getValue(cell + Coord(k & 1, k >> 1 & 1, k >> 2));
    }
    const Vec3d t = q - cell.asVec3d();
    for (size_t k = 0; k < 8; k += 2) v[k] += t[0] * (v[k + 1] - v[k]);
    for (size_t k = 0; k < 8; k += 4) v[k] += t[1] * (v[k + 2] - v[k]);
    return v[0] + t[2] * (v[4] - v[0]);
}

double LevelSet::operator()(const double* p, size_t& found) const {
    const double sum = p[0] + p[1] + p[2];
    if (std::isnan(sum)) return sum;
    if (std::isinf(sum)) return std::numeric_limits<double>::infinity();
    const Vec3d q = grid_->transform().baseMap()->applyInverseMap(Vec3d(p[0], p[1], p[2]));
    double value = linear(q);
    if (std::abs(value) > begin_) {
        found = points_.nearest(q, found);
        const double away = voxel_ * (points_.all()[found].at - q).length(), part = (std::abs(value) - begin_) / (end_ - begin_);
        value = std::copysign(std::lerp(std::abs(value), away, std::min(part, 1.0)), value);
    }
    return value / steepness_;
}

// The first of several, along each axis.
std::array<std::array<double, 3>, 6> LevelSet::outermost() const {
    std::array<std::array<double, 3>, 6> result;
    const Vec3d first = grid_->transform().indexToWorld(points_.all()[0].at);
    result.fill({first[0], first[1], first[2]});
    for (const SurfacePoint& point : points_.all()) {
        const Vec3d at = grid_->transform().indexToWorld(point.at);
        for (size_t k = 0; k < 3; ++k) {
            if (at[int(k)] < result[k][k]) result[k] = {at[0], at[1], at[2]};
            if (at[int(k)] > result[k + 3][k]) result[k + 3] = {at[0], at[1], at[2]};
        }
    }
    return result;
}

std::optional<std::array<std::array<double, 3>, 6>> LevelSet::tips() const {
    if (!along_axes(*grid_)) return std::nullopt;
    return outermost();
}

std::array<std::array<double, 3>, 2> LevelSet::box() const {
    const auto ends = outermost();
    // Along the axes of the grid the solid ends at edges; along others, within a cell of them.
    const double aside = along_axes(*grid_) ? 0 : voxel_;
    std::array<std::array<double, 3>, 2> corners;
    for (size_t k = 0; k < 3; ++k) corners[0][k] = ends[k][k] - aside, corners[1][k] = ends[k + 3][k] + aside;
    return corners;
}

}  // namespace fracslice::volume
