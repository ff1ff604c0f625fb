// Most pairs of a mesh are neighbours in a fan, and a line through their shared vertex separates them in the projection
// along an axis: that is tested first, with the fewest multiplications. A line that separates projections separates triangles.
#include "overlap.h"

#include <cmath>
#include <utility>

#include "predicates.h"

namespace fracslice::mesh {
namespace {

using Point = const double*;

struct Triangle {
    Point a, b, c;
    Aspect aspect;
};

constexpr int kNext[] = {1, 2, 0, 1};

// side_of_line, seen along an axis.
int turn(Point a, Point b, Point c, int axis) {
    int i = kNext[axis], j = kNext[axis + 1];
    return side_of_line(a[i], a[j], b[i], b[j], c[i], c[j]);
}

// Whether points lie strictly on one side of a plane, or all in it, or otherwise.
enum class Lie { kAside, kFlat, kAstride };

// On which sides of the plane of a triangle the corners of another lie.
struct Sides {
    int d, e, f;

    Lie lie() const { return d != e || d != f ? Lie::kAstride : d == 0 ? Lie::kFlat : Lie::kAside; }
};

// The plane of a triangle: side_of_plane for many points, its minors taken once. The bound is the same.
class Plane {
  public:
    explicit Plane(const Triangle& t) : a_(t.a), b_(t.b), c_(t.c) {
        double b[3], c[3];
        for (int k = 0; k < 3; ++k) b[k] = b_[k] - a_[k], c[k] = c_[k] - a_[k];
        for (int k = 0; k < 3; ++k) {
            double left = b[kNext[k]] * c[kNext[k + 1]], right = b[kNext[k + 1]] * c[kNext[k]];
            normal_[k] = left - right;
            bound_[k] = exact::kBound3 * (std::abs(left) + std::abs(right));
        }
    }

    int side(Point p) const {
        double x = p[0] - a_[0], y = p[1] - a_[1], z = p[2] - a_[2];
        double above = normal_[0] * x + normal_[1] * y + normal_[2] * z;
        double bound = bound_[0] * std::abs(x) + bound_[1] * std::abs(y) + bound_[2] * std::abs(z);
        if (std::abs(above) > bound) return above > 0 ? -1 : 1;
        return bound == 0 ? 0 : exact::side_of_plane(a_, b_, c_, p);
    }

    Sides sides(Point d, Point e, Point f) const { return {side(d), side(e), side(f)}; }
    // The same without the corner that both triangles have.
    Sides sides(Point e, Point f) const {
        int first = side(e);
        return {first, first, side(f)};
    }

  private:
    Point a_, b_, c_;
    double normal_[3], bound_[3];
};

// Whether the triangle s is seen to have the points d, e and f strictly beyond one of its edges.
bool beyond_edge(const Triangle& s, Point d, Point e, Point f) {
    int axis = s.aspect.axis, beyond = -s.aspect.turn;
    auto separates = [&](Point p, Point q) {
        return turn(p, q, d, axis) == beyond && turn(p, q, e, axis) == beyond && turn(p, q, f, axis) == beyond;
    };
    return separates(s.a, s.b) || separates(s.b, s.c) || separates(s.c, s.a);
}

// Triangles at a common corner, seen along an axis.
class Corner {
  public:
    // A point as seen from the corner.
    struct Seen {
        Point point;
        double x, y;
    };
    enum Side : unsigned { kNone = 0, kLeft = 1, kRight = 2, kBoth = 3 };

    Corner(Point at, int axis) : at_(at), axis_(axis), i_(kNext[axis]), j_(kNext[axis + 1]) {}

    Seen see(Point p) const { return {p, p[i_] - at_[i_], p[j_] - at_[j_]}; }

    // On which side of the line from the corner to p the point q lies: on the line, none, but behind the corner, both.
    unsigned side(const Seen& p, const Seen& q) const {
        double left = p.x * q.y, right = p.y * q.x, det = left - right;
        if (std::abs(det) > exact::kBound2 * (std::abs(left) + std::abs(right))) return det > 0 ? kLeft : kRight;
        return side_exactly(p, q);
    }

  private:
    [[gnu::noinline]] unsigned side_exactly(const Seen& p, const Seen& q) const {
        int side = turn(at_, p.point, q.point, axis_);
        if (side != 0) return side > 0 ? kLeft : kRight;
        return p.x * q.x < 0 || p.y * q.y < 0 ? kBoth : kNone;
    }

    Point at_;
    int axis_, i_, j_;
};

// Whether a line along an edge at a is seen to separate s and t, but for their shared corner a; sure if true.
bool separated_at_corner(const Triangle& s, const Triangle& t) {
    Corner at(s.a, s.aspect.axis);
    Corner::Seen b = at.see(s.b), c = at.see(s.c), e = at.see(t.b), f = at.see(t.c);
    unsigned be = at.side(b, e), bf = at.side(b, f), ce = at.side(c, e), cf = at.side(c, f);
    unsigned left = s.aspect.turn > 0 ? Corner::kLeft : Corner::kRight, right = Corner::kBoth - left;
    if ((be & bf & right) || (ce & cf & left)) return true;
    left = at.side(e, f);
    right = Corner::kBoth - left;
    return (left == Corner::kLeft || left == Corner::kRight) && ((be & ce & left) || (bf & cf & right));
}

bool within(Point p, const Triangle& t) {
    int axis = t.aspect.axis;
    int u = turn(t.a, t.b, p, axis), v = turn(t.b, t.c, p, axis), w = turn(t.c, t.a, p, axis);
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

bool intervals_meet(double p, double q, double a, double b) {
    return std::max(p, q) >= std::min(a, b) && std::max(a, b) >= std::min(p, q);
}

// Whether two closed segments of one plane meet.
bool segments_meet(Point p, Point q, Point a, Point b, int axis) {
    int u = turn(p, q, a, axis), v = turn(p, q, b, axis);
    if (u == 0 && v == 0) {
        int i = (axis + 1) % 3, j = (axis + 2) % 3;
        return intervals_meet(p[i], q[i], a[i], b[i]) && intervals_meet(p[j], q[j], a[j], b[j]);
    }
    return u * v <= 0 && turn(a, b, p, axis) * turn(a, b, q, axis) <= 0;
}

// Whether the closed segment p q, whose ends lie on these sides of the plane of t, meets the closed triangle.
bool edge_meets(Point p, Point q, int side_p, int side_q, const Triangle& t) {
    if (side_p * side_q > 0) return false;
    if (side_p == 0 && side_q == 0) {
        int axis = t.aspect.axis;
        return within(p, t) || segments_meet(p, q, t.a, t.b, axis) || segments_meet(p, q, t.b, t.c, axis) ||
               segments_meet(p, q, t.c, t.a, axis);
    }
    int u = side_of_plane(p, q, t.a, t.b), v = side_of_plane(p, q, t.b, t.c);
    if (u * v < 0) return false;
    int w = side_of_plane(p, q, t.c, t.a);
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

bool any_edge_meets(const Triangle& s, const Sides& of, const Triangle& t) {
    return edge_meets(s.a, s.b, of.d, of.e, t) || edge_meets(s.b, s.c, of.e, of.f, t) ||
           edge_meets(s.c, s.a, of.f, of.d, t);
}

bool strangers_overlap(const Triangle& s, const Triangle& t) {
    Sides of_t = Plane(s).sides(t.a, t.b, t.c);
    if (of_t.lie() == Lie::kAside) return false;
    Sides of_s = Plane(t).sides(s.a, s.b, s.c);
    if (of_s.lie() == Lie::kAside) return false;
    if (beyond_edge(s, t.a, t.b, t.c) || beyond_edge(t, s.a, s.b, s.c)) return false;
    return of_t.lie() == Lie::kFlat || any_edge_meets(s, of_s, t) || any_edge_meets(t, of_t, s);
}

// s and t share the corner a.
bool overlap_at_corner(const Triangle& s, const Triangle& t) {
    if (separated_at_corner(s, t)) return false;
    Sides of_t = Plane(s).sides(t.b, t.c);
    if (of_t.lie() == Lie::kAside) return false;
    Sides of_s = Plane(t).sides(s.b, s.c);
    if (of_s.lie() == Lie::kAside || separated_at_corner(t, s)) return false;
    // What they share beyond the corner ends on one of the edges opposite to it.
    return edge_meets(s.b, s.c, of_s.e, of_s.f, t) || edge_meets(t.b, t.c, of_t.e, of_t.f, s);
}

// Whether the triangle s and the one of its edge b c and the point p lie flat on each other.
bool folded(const Triangle& s, Point p) {
    return turn(s.b, s.c, p, s.aspect.axis) == s.aspect.turn && side_of_plane(s.a, s.b, s.c, p) == 0;
}

}  // namespace

Aspect aspect_of(const MeshView& mesh, size_t t) {
    Point a = mesh.corner(t, 0), b = mesh.corner(t, 1), c = mesh.corner(t, 2);
    Aspect best{0, 0};
    double broadest = 0;
    for (int k = 0; k < 3; ++k) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        double broad = std::abs((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]));
        if (!(broad > broadest)) continue;
        int exact = turn(a, b, c, k);
        if (exact != 0) best = {int8_t(k), int8_t(exact)}, broadest = broad;
    }
    return best;
}

bool overlap(const MeshView& mesh, const Facet& s, const Facet& t) {
    int shared = 0, i = 0, j = 0;
    for (int p = 0; p < 3; ++p) {
        for (int q = 0; q < 3; ++q) {  // without branches, which would be guessed wrong
            int same = s.corners[p] == t.corners[q];
            shared += same, i += same * p, j += same * q;
        }
    }
    if (shared == 3) return true;
    if (shared == 2) i = 3 - i, j = 3 - j;  // the corner that is not shared, else the one that is
    auto corner = [&](const Facet& of, int k) { return mesh.point(of.corners[k]); };
    Triangle one{corner(s, i), corner(s, kNext[i]), corner(s, kNext[i + 1]), s.aspect};
    if (shared == 2) return folded(one, corner(t, j));
    Triangle other{corner(t, j), corner(t, kNext[j]), corner(t, kNext[j + 1]), t.aspect};
    return shared == 1 ? overlap_at_corner(one, other) : strangers_overlap(one, other);
}

}  // namespace fracslice::mesh
