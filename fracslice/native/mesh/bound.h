// Proofs that triangles are near others.
#pragma once
#include <array>
#include <limits>
#include <vector>

#include "distance.h"

namespace fracslice::mesh {

// How often a triangle is cut before it is given up, and how often before the nearest triangle is looked for again
// though that of a neighbour is near, or what lies over a triangle is taken from what does not.
constexpr int kDepth = 32, kTrusting = 12, kPatient = 8;

// A triangle near a point, and its squared distance.
struct Neighbour {
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
        pieces_.resize(1);
        Piece& whole = pieces_[0];
        double most = 0;
        whole.depth = 0;
        hints_ = {near[0], near[1], near[2]};
        beyond_.clear();
        for (size_t k = 0; k < 3; ++k) {
            std::copy_n(corners[k], 3, whole.corner[k].data());
            Neighbour neighbour = {near[k], others_.distance(near[k]).square(corners[k])};
            if (neighbour.square > limit_) neighbour = search(corners[k], near[k]);
            if (neighbour.square > limit_) return kInfinity;
            whole.near[k] = near[k] = neighbour.triangle;
            most = std::max(most, neighbour.square);
        }
        while (!pieces_.empty()) {
            Piece piece = pieces_.back(), other;
            pieces_.pop_back();
            double bound = of(piece);
            if (bound > limit_) bound = laid(piece);
            if (bound <= limit_) {
                most = std::max(most, bound);
            } else if (piece.depth == kDepth || !cut(piece, other)) {
                return kInfinity;
            } else {
                pieces_.push_back(piece);
                pieces_.push_back(other);
            }
        }
        return most;
    }

    // Of what the last bound depends on besides those that might be near its corners.
    const std::vector<size_t>& beyond() const { return beyond_; }

  private:
    // A part of the triangle.
    struct Piece {
        Point corner[3];
        size_t near[3];
        int depth;
    };
    static constexpr double kInfinity = std::numeric_limits<double>::infinity();

    Neighbour search(const double* p, size_t guess) {
        Neighbour neighbour = others_(p, guess);
        auto known = [&](const auto& these) { return std::find(these.begin(), these.end(), neighbour.triangle) != these.end(); };
        if (!known(hints_) && !known(beyond_)) beyond_.push_back(neighbour.triangle);
        return neighbour;
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

    // A piece that is within the tolerance of the plane of the triangle nearest to its middle: what lies over that triangle is
    // near it, and what lies beside it is left. Returns a bound on the distance of the former; infinite if there is none.
    double laid(const Piece& piece) {
        if (piece.depth < kPatient || piece.depth == kDepth || !flat(piece, others_.distance(piece.near[0]).planes()[0])) return kInfinity;
        Point middle;
        for (size_t x = 0; x < 3; ++x) middle[x] = (piece.corner[0][x] + piece.corner[1][x] + piece.corner[2][x]) / 3;
        size_t nearest = search(middle.data(), piece.near[0]).triangle;
        auto planes = others_.distance(nearest).planes();
        if (!flat(piece, planes[0])) return kInfinity;
        Polygon over(piece.corner, piece.corner + 3), beside[3];
        for (size_t side = 0; side < 3; ++side) beside[side] = taken_above(planes[side + 1], over);
        if (over.empty()) return kInfinity;
        for (const Polygon& polygon : beside) {
            for (size_t i = 2; i < polygon.size(); ++i) {
                Piece part{{polygon[0], polygon[i - 1], polygon[i]}, {}, piece.depth + 1};
                for (size_t k = 0; k < 3; ++k) {
                    Neighbour neighbour = search(part.corner[k].data(), nearest);
                    if (neighbour.square > limit_) return kInfinity;
                    part.near[k] = neighbour.triangle;
                }
                pieces_.push_back(part);
            }
        }
        double most = 0;
        for (const Point& p : over) most = std::max(most, others_.distance(nearest).square(p.data()));
        return most;
    }

    // Whether a piece is within the tolerance of a plane.
    bool flat(const Piece& piece, const Plane& plane) const {
        return std::all_of(piece.corner, piece.corner + 3, [&](const Point& p) {
            double d = plane.above(p);
            return d * d <= limit_;
        });
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
        Neighbour neighbour{piece.near[d < e ? k : next], std::min(d, e)};
        if (neighbour.square > limit_ || piece.depth >= kTrusting) neighbour = search(point.data(), neighbour.triangle);
        if (neighbour.square > limit_) return false;
        ++piece.depth;
        other = piece;
        piece.corner[next] = other.corner[k] = point;
        piece.near[next] = other.near[k] = neighbour.triangle;
        return true;
    }

    const Others& others_;
    double limit_;
    std::array<size_t, 3> hints_{};
    std::vector<size_t> beyond_;
    std::vector<Piece> pieces_;
};

}  // namespace fracslice::mesh
