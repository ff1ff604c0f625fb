// Proofs that triangles are near others.
#pragma once
#include <array>
#include <limits>
#include <vector>

#include "distance.h"

namespace fracslice {

// How often a triangle is cut before nothing is said of it, and how often before the nearest triangle is looked for again
// though that of a neighbour is near.
constexpr int kDepth = 32, kTrusting = 12;

// What is nearest to a point, beginning with a guess.
struct Found {
    size_t triangle;
    double square;
};

// How far a triangle is from others: others.distance(t) is that from one of them, others(p, guess) finds the one nearest to p.
template <class Others>
class Bound {
  public:
    Bound(const Others& others, double tolerance) : others_(others), limit_(tolerance * tolerance) {}

    // The square of a bound on the distance; infinite if some point is farther than the tolerance, or that could not be
    // excluded. near: of each corner one of the others that may be near it, and then one that is.
    double operator()(const std::array<const double*, 3>& corners, size_t* near) {
        Piece& whole = pieces_[0];
        double most = 0;
        whole.depth = 0;
        hints_ = {near[0], near[1], near[2]};
        beyond_.clear();
        for (size_t k = 0; k < 3; ++k) {
            std::copy_n(corners[k], 3, whole.corner[k].data());
            Found found = {near[k], others_.distance(near[k]).square(corners[k])};
            if (found.square > limit_) found = search(corners[k], near[k]);
            if (found.square > limit_) return kInfinity;
            whole.near[k] = near[k] = found.triangle;
            most = std::max(most, found.square);
        }
        for (int height = 1; height > 0;) {
            Piece& piece = pieces_[--height];
            double bound = of(piece);
            if (bound <= limit_) {
                most = std::max(most, bound);
            } else if (piece.depth == kDepth || !cut(piece, pieces_[height + 1])) {
                return kInfinity;
            } else {
                height += 2;
            }
        }
        return most;
    }

    // Of what the last bound depends on besides those that might be near its corners.
    const std::vector<size_t>& beyond() const { return beyond_; }

  private:
    using Point = std::array<double, 3>;
    // A part of the triangle.
    struct Piece {
        Point corner[3];
        size_t near[3];
        int depth;
    };
    static constexpr double kInfinity = std::numeric_limits<double>::infinity();

    Found search(const double* p, size_t guess) {
        Found found = others_(p, guess);
        auto known = [&](const auto& these) { return std::find(these.begin(), these.end(), found.triangle) != these.end(); };
        if (!known(hints_) && !known(beyond_)) beyond_.push_back(found.triangle);
        return found;
    }

    // The distance to one triangle is a convex function: where all corners are near the same one, so is the whole piece.
    double of(const Piece& piece) const {
        double bound = kInfinity;
        for (int k = 0; k < 3; ++k) {
            if ((k > 0 && piece.near[k] == piece.near[0]) || (k > 1 && piece.near[2] == piece.near[1])) continue;
            TriangleDistance near = others_.distance(piece.near[k]);
            double worst = 0;
            for (const Point& corner : piece.corner) worst = std::max(worst, near.square(corner.data()));
            bound = std::min(bound, worst);
        }
        return bound;
    }

    // Cuts a piece in two. The longest edge between corners that are near different triangles is cut where both are equally
    // far, so that each piece soon has a triangle of its own; now and then in its middle, so that pieces get small. False if
    // the point between them is too far off.
    bool cut(Piece& piece, Piece& other) {
        int k = -1;
        double longest = -1;
        for (int j = 0; j < 3; ++j) {
            double d = 0;
            for (size_t x = 0; x < 3; ++x) {
                double side = piece.corner[j][x] - piece.corner[size_t(j + 1) % 3][x];
                d += side * side;
            }
            if (d > longest && piece.near[j] != piece.near[(j + 1) % 3]) k = j, longest = d;
        }
        if (k < 0) return false;
        int next = (k + 1) % 3;
        TriangleDistance one = others_.distance(piece.near[k]), two = others_.distance(piece.near[next]);
        double low = 0, high = 1, d = 0, e = 0;
        Point point;
        for (int step = piece.depth % 4 == 3 ? 1 : 5; step > 0; --step) {
            double t = (low + high) / 2;
            for (size_t x = 0; x < 3; ++x) point[x] = piece.corner[k][x] + t * (piece.corner[next][x] - piece.corner[k][x]);
            d = one.square(point.data()), e = two.square(point.data());
            (d < e ? low : high) = t;
        }
        Found found{piece.near[d < e ? k : next], std::min(d, e)};
        if (found.square > limit_ || piece.depth >= kTrusting) found = search(point.data(), found.triangle);
        if (found.square > limit_) return false;
        ++piece.depth;
        other = piece;
        piece.corner[next] = other.corner[k] = point;
        piece.near[next] = other.near[k] = found.triangle;
        return true;
    }

    const Others& others_;
    double limit_;
    std::array<size_t, 3> hints_{};
    std::vector<size_t> beyond_;
    Piece pieces_[kDepth + 2];
};

}  // namespace fracslice
