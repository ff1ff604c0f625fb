// Most pairs of a mesh are neighbours in a fan, and a line through their shared vertex separates them as they are seen along
// one axis: that is asked first, with the fewest multiplications. What separates what is seen separates the triangles.
#include "overlap.h"

#include <cmath>
#include <utility>

#include "predicates.h"

namespace fracslice {
namespace {

using Point = const double*;

struct Triangle {
    Point a, b, c;
    Aspect aspect;
};

// side_of_line, seen along an axis.
int turn(Point a, Point b, Point c, int axis) {
    constexpr int next[] = {1, 2, 0, 1};
    int i = next[axis], j = next[axis + 1];
    return side_of_line(a[i], a[j], b[i], b[j], c[i], c[j]);
}

// Whether three points lie strictly on one side of the plane of a triangle, or all in it, or otherwise.
enum class Lie { kAside, kFlat, kAstride };

struct Sides {
    int d, e, f;

    Lie lie() const { return d != e || d != f ? Lie::kAstride : d == 0 ? Lie::kFlat : Lie::kAside; }
};

Sides sides(const Triangle& s, Point d, Point e, Point f) {
    return {side_of_plane(s.a, s.b, s.c, d), side_of_plane(s.a, s.b, s.c, e), side_of_plane(s.a, s.b, s.c, f)};
}

Sides sides(const Triangle& s, Point e, Point f) {
    int side = side_of_plane(s.a, s.b, s.c, e);
    return {side, side, side_of_plane(s.a, s.b, s.c, f)};
}

// Whether the triangle s is seen to have the points d, e and f strictly beyond one of its edges.
bool beyond_edge(const Triangle& s, Point d, Point e, Point f) {
    int axis = s.aspect.axis, beyond = -s.aspect.turn;
    auto separates = [&](Point p, Point q) {
        return turn(p, q, d, axis) == beyond && turn(p, q, e, axis) == beyond && turn(p, q, f, axis) == beyond;
    };
    return separates(s.a, s.b) || separates(s.b, s.c) || separates(s.c, s.a);
}

// Whether p is seen on the side `beyond` of the line from a to b, or on it, but with a strictly between p and b.
bool beyond_line(Point a, Point b, Point p, int axis, int beyond) {
    int side = turn(a, b, p, axis);
    if (side != 0) return side == beyond;
    int k = (axis + 1) % 3;
    if (a[k] == b[k]) k = (axis + 2) % 3;
    return b[k] > a[k] ? p[k] < a[k] : p[k] > a[k];
}

// Whether a line along an edge at a is seen to separate s and t, but for their shared corner a; sure if true.
bool apart_at_corner(const Triangle& s, const Triangle& t) {
    int axis = s.aspect.axis, left = s.aspect.turn;
    auto separates = [&](Point to, Point p, Point q, int beyond) {
        return beyond_line(s.a, to, p, axis, beyond) && beyond_line(s.a, to, q, axis, beyond);
    };
    if (separates(s.b, t.b, t.c, -left) || separates(s.c, t.b, t.c, left)) return true;
    left = turn(s.a, t.b, t.c, axis);
    return left != 0 && (separates(t.b, s.b, s.c, -left) || separates(t.c, s.b, s.c, left));
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
    Sides of_t = sides(s, t.a, t.b, t.c);
    if (of_t.lie() == Lie::kAside) return false;
    Sides of_s = sides(t, s.a, s.b, s.c);
    if (of_s.lie() == Lie::kAside) return false;
    if (beyond_edge(s, t.a, t.b, t.c) || beyond_edge(t, s.a, s.b, s.c)) return false;
    return of_t.lie() == Lie::kFlat || any_edge_meets(s, of_s, t) || any_edge_meets(t, of_t, s);
}

// s and t share the corner a.
bool overlap_at_corner(const Triangle& s, const Triangle& t) {
    if (apart_at_corner(s, t)) return false;
    Sides of_t = sides(s, t.b, t.c);
    if (of_t.lie() == Lie::kAside) return false;
    Sides of_s = sides(t, s.b, s.c);
    if (of_s.lie() == Lie::kAside) return false;
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

bool overlap(const MeshView& mesh, size_t s, size_t t, Aspect of_s, Aspect of_t) {
    int shared = 0, i = 0, j = 0, sum_i = 0, sum_j = 0;
    for (int p = 0; p < 3; ++p) {
        for (int q = 0; q < 3; ++q) {
            if (mesh[s][p] != mesh[t][q]) continue;
            ++shared, i = p, j = q;
            sum_i += p, sum_j += q;
        }
    }
    if (shared == 3) return true;
    if (shared == 2) i = 3 - sum_i, j = 3 - sum_j;  // the corner that is not shared
    Triangle one{mesh.corner(s, i), mesh.corner(s, i + 1), mesh.corner(s, i + 2), of_s};
    if (shared == 2) return folded(one, mesh.corner(t, j));
    Triangle other{mesh.corner(t, j), mesh.corner(t, j + 1), mesh.corner(t, j + 2), of_t};
    return shared == 1 ? overlap_at_corner(one, other) : strangers_overlap(one, other);
}

}  // namespace fracslice
