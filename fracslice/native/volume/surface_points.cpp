#include "surface_points.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <limits>

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

}  // namespace fracslice::volume
