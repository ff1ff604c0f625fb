#include "tree.h"

#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <utility>
#include <vector>

#include "predicates.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

// The boxes of the triangles of a leaf, so that one can be held against all of them at once.

namespace fracslice::mesh {

// Rounded to float32 and outwards: boxes that meet meet still, and for float32 coordinates no others.
inline float below(double x) {
    float rounded = float(x);
    return rounded > x ? std::nextafter(rounded, -std::numeric_limits<float>::infinity()) : rounded;
}
inline float above(double x) { return -below(-x); }

struct Box {
    float low[3], high[3];
};

inline Box box_of(const double* low, const double* high) {
    return {{below(low[0]), below(low[1]), below(low[2])}, {above(high[0]), above(high[1]), above(high[2])}};
}

struct LeafBoxes {
    float low[3][kLeaf], high[3][kLeaf];

    void set(size_t lane, const double* a, const double* b, const double* c) {
        for (int k = 0; k < 3; ++k) {
            low[k][lane] = below(std::min(a[k], std::min(b[k], c[k])));
            high[k][lane] = above(std::max(a[k], std::max(b[k], c[k])));
        }
    }

    // A box that meets none.
    void clear(size_t lane) {
        for (int k = 0; k < 3; ++k) {
            low[k][lane] = std::numeric_limits<float>::infinity();
            high[k][lane] = -std::numeric_limits<float>::infinity();
        }
    }

    Box operator[](size_t lane) const {
        return {{low[0][lane], low[1][lane], low[2][lane]}, {high[0][lane], high[1][lane], high[2][lane]}};
    }

    // A bit for each box that meets another.
    unsigned meeting(const Box& box) const {
        unsigned result = 0;
#if defined(__SSE2__)
        for (size_t lane = 0; lane < kLeaf; lane += 4) {
            __m128 meets = _mm_castsi128_ps(_mm_set1_epi32(-1));
            for (int k = 0; k < 3; ++k) {
                meets = _mm_and_ps(meets, _mm_cmple_ps(_mm_loadu_ps(low[k] + lane), _mm_set1_ps(box.high[k])));
                meets = _mm_and_ps(meets, _mm_cmpge_ps(_mm_loadu_ps(high[k] + lane), _mm_set1_ps(box.low[k])));
            }
            result |= unsigned(_mm_movemask_ps(meets)) << lane;
        }
#else
        for (size_t lane = 0; lane < kLeaf; ++lane) {
            bool meets = true;
            for (int k = 0; k < 3; ++k) meets &= low[k][lane] <= box.high[k] && high[k][lane] >= box.low[k];
            result |= unsigned(meets) << lane;
        }
#endif
        return result;
    }
};

// --- Whether two triangles of a mesh meet in more than what their shared vertices span, decided by signs of exact predicates
// alone (the idea of Guigue and Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates",
// 2003).

// How a triangle is seen along the axis along which it is broadest: its corners turn that way, 1 or -1. 0 for a triangle
// without area.
struct Aspect {
    int8_t axis, turn;
};

Aspect aspect_of(const MeshView& mesh, size_t t);

struct Facet {
    int32_t corners[3];
    Aspect aspect;
};

// Different triangles with area.
bool overlap(const MeshView& mesh, const Facet& s, const Facet& t);

// Most pairs of a mesh are neighbours in a fan, and a line through their shared vertex separates them in the projection
// along an axis: that is tested first, with the fewest multiplications. A line that separates projections separates triangles.
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

// From the root down each node hands its children those nodes of the same level that their boxes meet. Pairs are looked at
// once: at the node of the lower number.
namespace {

// Leaves of a task.
constexpr size_t kTask = 256;

class Pairs {
  public:
    Pairs(const MeshView& mesh, const TreeView& tree, const bool* among)
        : mesh_(mesh), tree_(tree), among_(among), holds_(2 * tree.leaves, !among), aspects_(mesh.count), marks_(mesh.count) {
        tbb::parallel_for(size_t(0), mesh.count, [&](size_t t) { aspects_[t] = aspect_of(mesh, t); });
        for (size_t i = 0; among && i < tree.count; ++i) holds_[tree.leaves + i / kLeaf] |= among[tree.order[i]];
        for (size_t node = tree.leaves; among && --node > 0;) holds_[node] = holds_[2 * node] | holds_[2 * node + 1];
    }

    Array<bool> run();

  private:
    // What one thread needs.
    class Search;

    bool meet(size_t a, size_t b) const {
        const double *low = tree_.low, *high = tree_.high;
        bool separate = !holds_[a] && !holds_[b];
        for (int k = 0; k < 3; ++k) separate |= (low[3 * a + k] > high[3 * b + k]) | (high[3 * a + k] < low[3 * b + k]);
        return !separate;
    }

    bool asked(size_t s, size_t t) const { return !among_ || among_[s] || among_[t]; }
    bool marked(size_t t) const { return marks_[t].load(std::memory_order_relaxed); }
    void mark(size_t t) { marks_[t].store(true, std::memory_order_relaxed); }

    const MeshView& mesh_;
    const TreeView& tree_;
    const bool* among_;
    std::vector<uint8_t> holds_;  // for each node whether some of its triangles are asked about
    std::vector<Aspect> aspects_;
    std::vector<std::atomic<bool>> marks_;
};

class Pairs::Search {
  public:
    explicit Search(Pairs& pairs) : pairs_(pairs), mesh_(pairs.mesh_), tree_(pairs.tree_), cache_(kCached) {}

    // All pairs of a leaf below a node.
    void below(size_t node) {
        others_.assign(1, 1);
        size_t first = 0;
        int depth = 0;
        while (node >> depth > 1) ++depth;
        while (depth-- > 0) {
            size_t last = others_.size();
            hand_down(node >> depth, first, last);
            first = last;
        }
        visit(node, first);
    }

  private:
    struct Leaf {
        size_t number = size_t(-1);
        LeafBoxes boxes;
        Facet facets[kLeaf];
    };
    static constexpr size_t kCached = 256;

    void visit(size_t node, size_t first) {
        size_t last = others_.size();
        if (node >= tree_.leaves) {
            Leaf mine = leaf(node - tree_.leaves);  // the cache may lose it to another
            for (size_t i = first; i < last; ++i) mark_leaves(node, mine, others_[i]);
            return;
        }
        for (size_t child : {2 * node, 2 * node + 1}) {
            hand_down(child, first, last);
            if (others_.size() > last) visit(child, last);
            others_.resize(last);
        }
    }

    // Adds to the end of the list the children of the nodes in [first, last) that meet the child.
    void hand_down(size_t child, size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) {
            for (size_t other : {2 * others_[i], 2 * others_[i] + 1}) {
                if (other >= child && pairs_.meet(child, other)) others_.push_back(other);
            }
        }
    }

    // Neighbours in space follow each other: they are kept a while.
    const Leaf& leaf(size_t number) {
        Leaf& leaf = cache_[number % kCached];
        if (leaf.number == number) return leaf;
        leaf.number = number;
        for (size_t lane = 0; lane < kLeaf; ++lane) leaf.boxes.clear(lane);
        for (size_t i = tree_.first(number); i < tree_.last(number); ++i) {
            size_t t = size_t(tree_.order[i]), lane = i % kLeaf;
            if (pairs_.aspects_[t].turn == 0) continue;
            leaf.boxes.set(lane, mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2));
            leaf.facets[lane] = {{mesh_[t][0], mesh_[t][1], mesh_[t][2]}, pairs_.aspects_[t]};
        }
        return leaf;
    }

    void mark_leaves(size_t node, const Leaf& mine, size_t other) {
        const Leaf& theirs = leaf(other - tree_.leaves);
        unsigned near = theirs.boxes.meeting(box_of(tree_.low + 3 * node, tree_.high + 3 * node));
        for (; near; near &= near - 1) {
            size_t j = size_t(std::countr_zero(near));
            unsigned met = mine.boxes.meeting(theirs.boxes[j]);
            if (node == other) met &= (1u << j) - 1;
            for (; met; met &= met - 1) mark_pair(mine, size_t(std::countr_zero(met)), theirs, j);
        }
    }

    void mark_pair(const Leaf& one, size_t i, const Leaf& other, size_t j) {
        size_t s = size_t(tree_.order[tree_.first(one.number) + i]);
        size_t t = size_t(tree_.order[tree_.first(other.number) + j]);
        if (!pairs_.asked(s, t) || (pairs_.marked(s) && pairs_.marked(t)) || !overlap(mesh_, one.facets[i], other.facets[j])) return;
        pairs_.mark(s);
        pairs_.mark(t);
    }

    Pairs& pairs_;
    const MeshView& mesh_;
    const TreeView& tree_;
    std::vector<Leaf> cache_;
    std::vector<size_t> others_;
};

Array<bool> Pairs::run() {
    size_t first = 1;
    for (size_t below = tree_.leaves; below > kTask; below /= 2) first *= 2;
    tbb::enumerable_thread_specific<Search> searches([&] { return Search(*this); });
    tbb::parallel_for(first, 2 * first, [&](size_t node) { searches.local().below(node); });
    Array<bool> marks(mesh_.count, 1);
    std::copy(marks_.begin(), marks_.end(), marks.data.get());
    return marks;
}

}  // namespace

Array<bool> self_intersecting_triangles(const MeshView& mesh, const TreeView& tree, const bool* among) {
    return Pairs(mesh, tree, among).run();
}

}  // namespace fracslice::mesh
