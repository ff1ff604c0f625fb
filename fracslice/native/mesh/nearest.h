// How far other meshes are from one: proved, or sampled.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "triangles.h"

// How far points are from a triangle (Ericson, "Real-Time Collision Detection", 2005).

namespace fracslice::mesh {

using Point = std::array<double, 3>;
using Polygon = std::vector<Point>;  // its corners in order

// Where points have dot(normal, point) = offset.
struct Plane {
    Point normal;
    double offset;

    double above(const Point& p) const { return normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2] - offset; }
};

// Cuts a convex polygon at a plane (Sutherland and Hodgman 1974, "Reentrant polygon clipping"). Returns the part above it;
// the polygon becomes the part below.
inline Polygon taken_above(const Plane& plane, Polygon& polygon) {
    Polygon above, below;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const Point &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        double d = plane.above(p), e = plane.above(q);
        (d > 0 ? above : below).push_back(p);
        if ((d > 0) == (e > 0)) continue;
        Point between;
        for (size_t x = 0; x < 3; ++x) between[x] = p[x] + d / (d - e) * (q[x] - p[x]);
        above.push_back(between), below.push_back(between);
    }
    if (below.size() < 3) below.clear();
    polygon = below;
    if (above.size() < 3) above.clear();
    return above;
}

// What many points ask of one triangle is worked out once.
class TriangleDistance {
  public:
    TriangleDistance() = default;
    TriangleDistance(const double* a, const double* b, const double* c) {
        for (int k = 0; k < 3; ++k) a_[k] = a[k], u_[k] = b[k] - a[k], v_[k] = c[k] - a[k];
        uu_ = dot(u_, u_), uv_ = dot(u_, v_), vv_ = dot(v_, v_);
    }
    TriangleDistance(const MeshView& mesh, size_t t) : TriangleDistance(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)) {}

    // Parts of a triangle: its inside, its corners, and the side opposite to each corner.
    enum Part { kInside, kCorner, kSide = kCorner + 3 };

    // The square of the distance of the nearest point; where a needle of a triangle leaves no digits to find it, of another of
    // its points, never of one outside.
    double square(const double* p) const {
        double x[3];
        away(p, x);
        return dot(x, x);
    }
    // The vector from the nearest point, and the part that this point is on: kCorner + k is corner k.
    int away(const double* p, double* x) const {
        for (int k = 0; k < 3; ++k) x[k] = p[k] - a_[k];
        double d1 = dot(u_, x), d2 = dot(v_, x);
        if (d1 <= 0 && d2 <= 0) return kCorner;
        double d3 = d1 - uu_, d4 = d2 - uv_, d5 = d1 - uv_, d6 = d2 - vv_, s = 0, t = 0;
        int part = kInside;
        if (d3 >= 0 && d4 <= d3) {
            s = 1, part = kCorner + 1;
        } else if (d6 >= 0 && d5 <= d6) {
            t = 1, part = kCorner + 2;
        } else if (d1 * d4 - d3 * d2 <= 0 && d1 >= 0 && d3 <= 0) {
            s = d1 / (d1 - d3), part = kSide + 2;
        } else if (d5 * d2 - d1 * d6 <= 0 && d2 >= 0 && d6 <= 0) {
            t = d2 / (d2 - d6), part = kSide + 1;
        } else if (d3 * d6 - d5 * d4 <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
            t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            s = 1 - t, part = kSide;
        } else if (double area = square_area(); area > 0) {
            s = std::clamp((vv_ * d1 - uv_ * d2) / area, 0.0, 1.0);
            t = std::clamp((uu_ * d2 - uv_ * d1) / area, 0.0, 1 - s);
        }
        for (int k = 0; k < 3; ++k) x[k] -= s * u_[k] + t * v_[k];
        return part;
    }

    // The normal, as long as twice the area; the square of its length, and the sum of the squares of the sides.
    void normal(double* n) const {
        for (int k = 0; k < 3; ++k) {
            int i = (k + 1) % 3, j = (k + 2) % 3;
            n[k] = u_[i] * v_[j] - u_[j] * v_[i];
        }
    }
    // The plane that it lies in, its normal a unit vector; and those through its sides, their normals outwards.
    std::array<Plane, 4> planes() const {
        std::array<Plane, 4> result;
        double w[3] = {v_[0] - u_[0], v_[1] - u_[1], v_[2] - u_[2]};
        const double *along[3] = {u_, w, v_};
        Point n;
        normal(n.data());
        double size = std::sqrt(dot(n.data(), n.data()));
        for (double& x : n) x /= size;
        result[0] = {n, dot(n.data(), a_)};
        for (size_t side = 0; side < 3; ++side) {
            double from[3];
            for (size_t k = 0; k < 3; ++k) {
                size_t i = (k + 1) % 3, j = (k + 2) % 3;
                double across = along[side][i] * n[j] - along[side][j] * n[i];
                result[side + 1].normal[k] = side == 2 ? -across : across;
                from[k] = a_[k] + (side == 1 ? u_[k] : 0);
            }
            result[side + 1].offset = dot(result[side + 1].normal.data(), from);
        }
        return result;
    }
    double square_area() const { return uu_ * vv_ - uv_ * uv_; }
    double square_sides() const { return 2 * (uu_ + vv_ - uv_); }

  private:
    static double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

    double a_[3], u_[3], v_[3], uu_, uv_, vv_;
};

// Proofs that triangles are near others.

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

class Nearest {
  public:
    // A mesh and its tree outlive this. closed: whether it is a closed, oriented 2-manifold, in which walks are shorter.
    Nearest(const MeshView& mesh, const TreeView& tree, bool closed);

    TriangleDistance distance(size_t t) const { return {mesh_, t}; }
    // The triangle nearest to a point; the search begins with a guess.
    Neighbour operator()(const double* p, size_t guess) const;
    // Of several that are as near the first, whatever the guess.
    Neighbour first(const double* p, size_t guess) const;
    // The same, or something whose distance has a square within a limit.
    Neighbour within(double limit, const double* p, size_t guess) const;

    // For each triangle a bound on how far its points are; infinite where one is farther than the tolerance, or that could not be
    // excluded. hints: of each corner a triangle here that may be near it, [count, 3], or empty. Returns what bounds depend on
    // besides: a triangle, and one here.
    using Pair = std::array<int32_t, 2>;
    std::vector<Pair> bounds(const MeshView& triangles, std::span<const int32_t> hints, double tolerance, double* distances) const;
    // The distance of each of the points [n, 3], on all threads or on this one. Points that lie close together are fast.
    void points(std::span<const double> points, double* distances) const;
    void near(std::span<const double> points, double* distances) const;
    // For each triangle how far its samples are at most: exactly, but for distances below `enough`. Samples are at most `spacing`
    // apart along its edges.
    void samples(const MeshView& triangles, double spacing, double enough, double* distances) const;

  private:
    // Side by side, a little larger than they are.
    template <size_t kCount>
    struct Boxes {
        float low[3][kCount], high[3][kCount];

        void set(size_t i, const double* lowest, const double* highest, double more);
        void squares(const float* p, size_t count, float* out) const;
    };
    // Circles around triangles, side by side: centres, unit normals, radii.
    struct Circles {
        float centre[3][kLeaf], normal[3][kLeaf], radius[kLeaf];

        void set(size_t i, const MeshView& mesh, size_t t, double more);
        void squares(const float* p, float more, float* out) const;
    };
    struct Found;
    class Run;

    void widen();
    // The square of the distance to the box of a node.
    double to_box(const double* p, size_t node) const;
    template <bool kFirst>
    Neighbour found(const double* p, size_t guess) const;
    // The same from so far away that floats do not tell boxes apart.
    template <bool kFirst>
    Neighbour remote(const double* p, Neighbour best) const;
    // Looks for a nearer triangle in a leaf; kFirst: or one as near and before.
    template <bool kFirst>
    void search(size_t leaf, const double* p, const float* rounded, Neighbour& best) const;
    // The leaves whose boxes are within a distance of a point, given its square; false if there are too many.
    bool around(const double* p, double reach, Found& found) const;
    double sampled(const MeshView& triangles, size_t t, double spacing, double limit, size_t& guess) const;

    MeshView mesh_;
    TreeView tree_;
    std::vector<Circles> circles_;  // of the triangles of each leaf
    double larger_;                 // by what boxes and circles are larger
    double remote_;                 // square of the distance from where on a search is `remote`
    // The tree with eight children of a node: those of node i are roots_ + 8 i and on. Leaves follow the inner nodes.
    std::vector<Boxes<kLeaf>> wide_;
    size_t roots_;
    std::vector<int32_t> across_;
};

}  // namespace fracslice::mesh
