#include "tree.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "predicates.h"
#include "quantise.h"
#include "triangles.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace fracslice::mesh {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Bits of a place along an axis, and of a triangle's number: a key holds three and one of these.
constexpr int kPlaceBits = 11, kNumberBits = 31;

// Puts two empty bits between the bits of x.
uint64_t spread(uint64_t x) {
    x = (x | x << 16) & 0xFF0000FF;
    x = (x | x << 8) & 0xF00F00F00F;
    x = (x | x << 4) & 0xC30C30C30C3;
    return (x | x << 2) & 0x249249249249;
}

// The place of each triangle's middle on Morton's curve, in a grid of 2^11 cells along the longest side, before its number.
Array<uint64_t> keys(const MeshView& mesh) {
    constexpr double most = (1 << kPlaceBits) - 1;
    Bounds box = bounds({mesh.positions, 3 * mesh.vertices});
    double size = 0;
    for (int k = 0; k < 3; ++k) size = std::max(size, box.high[k] - box.low[k]);
    double scale = size > 0 ? most / size : 0;
    Array<uint64_t> keys(mesh.count, 1);
    tbb::parallel_for(size_t(0), mesh.count, [&](size_t t) {
        uint64_t code = 0;
        for (int k = 0; k < 3; ++k) {
            double middle = (mesh.corner(t, 0)[k] + mesh.corner(t, 1)[k] + mesh.corner(t, 2)[k]) / 3;
            code |= spread(uint64_t(std::clamp((middle - box.low[k]) * scale, 0.0, most))) << k;
        }
        keys.data[t] = code << kNumberBits | t;
    });
    return keys;
}

// The keys in the order of their places, then of their numbers: sorted by digits, the last first. Each block knows where its keys
// with a digit go.
Array<uint64_t> sorted(Array<uint64_t> keys) {
    constexpr int bits = 11, digits = 3 * kPlaceBits / bits;
    constexpr size_t values = size_t(1) << bits, parts = 64;
    size_t n = keys.rows, size = (n + parts - 1) / parts;
    Array<uint64_t> next(n, 1);
    std::vector<std::array<size_t, values>> before(parts);
    for (int d = 0; d < digits; ++d) {
        auto for_each = [&](size_t part, const auto& act) {
            for (size_t i = std::min(n, part * size), last = std::min(n, i + size); i < last; ++i) {
                act(keys.data[i], before[part][keys.data[i] >> (kNumberBits + bits * d) & (values - 1)]);
            }
        };
        tbb::parallel_for(size_t(0), parts, [&](size_t part) {
            before[part].fill(0);
            for_each(part, [](uint64_t, size_t& count) { ++count; });
        });
        size_t total = 0;
        for (size_t value = 0; value < values; ++value) {
            for (auto& part : before) total += std::exchange(part[value], total);
        }
        tbb::parallel_for(size_t(0), parts, [&](size_t part) {
            for_each(part, [&](uint64_t key, size_t& place) { next.data[place++] = key; });
        });
        std::swap(keys, next);
    }
    return keys;
}

using Middle = std::array<float, 3>;

// Cuts a run of triangles in two across the longest side of the box of their middles, and each part again, down to leaves.
void halve(const std::vector<Middle>& middles, int64_t* first, int64_t* last, size_t leaves) {
    if (size_t(last - first) <= kLeaf) return;
    leaves /= 2;
    int64_t* half = std::min(first + leaves * kLeaf, last);  // whole leaves, and empty ones at the end
    if (half < last) {
        Middle low = middles[size_t(*first)], high = low;
        for (const int64_t* t = first; t < last; ++t) {
            const Middle& middle = middles[size_t(*t)];
            for (size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], middle[k]), high[k] = std::max(high[k], middle[k]);
        }
        size_t axis = 0;
        for (size_t k = 1; k < 3; ++k) axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
        std::nth_element(first, half, last, [&](int64_t a, int64_t b) {
            return std::pair(middles[size_t(a)][axis], a) < std::pair(middles[size_t(b)][axis], b);
        });
    }
    tbb::parallel_invoke([&] { halve(middles, first, half, leaves); }, [&] { halve(middles, half, last, leaves); });
}

Array<int64_t> in_morton_order(const MeshView& mesh) {
    Array<uint64_t> order = sorted(keys(mesh));
    Array<int64_t> result(mesh.count, 1);
    for_each_number(mesh.count, [&](size_t i) { result.data[i] = int64_t(order.data[i] & ((uint64_t(1) << kNumberBits) - 1)); });
    return result;
}

Array<int64_t> in_halves(const MeshView& mesh, size_t leaves) {
    std::vector<Middle> middles(mesh.count);
    Array<int64_t> result(mesh.count, 1);
    for_each_number(mesh.count, [&](size_t t) {
        result.data[t] = int64_t(t);
        for (size_t k = 0; k < 3; ++k) middles[t][k] = float((mesh.corner(t, 0)[k] + mesh.corner(t, 1)[k] + mesh.corner(t, 2)[k]) / 3);
    });
    halve(middles, result.data.get(), result.data.get() + mesh.count, leaves);
    return result;
}

void set_leaf(const MeshView& mesh, const int64_t* first, const int64_t* last, double* low, double* high) {
    std::fill_n(low, 3, kInfinity);
    std::fill_n(high, 3, -kInfinity);
    for (; first < last; ++first) {
        for (int corner = 0; corner < 3; ++corner) {
            const double* p = mesh.corner(size_t(*first), corner);
            for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
        }
    }
}

}  // namespace

Tree build_tree(const MeshView& mesh, bool halved) {
    Tree tree;
    if (mesh.count >> kNumberBits) throw std::invalid_argument("more than 2^31 triangles");
    size_t leaves = 1;
    while (leaves * kLeaf < mesh.count) leaves *= 2;
    tree.order = halved ? in_halves(mesh, leaves) : in_morton_order(mesh);
    tree.low = {2 * leaves, 3}, tree.high = {2 * leaves, 3};
    double *low = tree.low.data.get(), *high = tree.high.data.get();
    set_leaf(mesh, nullptr, nullptr, low, high);  // node 0, which is none
    tbb::parallel_for(size_t(0), leaves, [&](size_t leaf) {
        const int64_t* all = tree.order.data.get();
        size_t first = std::min(leaf * kLeaf, mesh.count), last = std::min(first + kLeaf, mesh.count);
        set_leaf(mesh, all + first, all + last, low + 3 * (leaves + leaf), high + 3 * (leaves + leaf));
    });
    for (size_t level = leaves / 2; level > 0; level /= 2) {
        for_each_block(level, [&](size_t, size_t first, size_t last) {
            for (size_t i = 3 * (level + first); i < 3 * (level + last); ++i) {
                size_t child = 6 * (i / 3) + i % 3;
                low[i] = std::min(low[child], low[child + 3]);
                high[i] = std::max(high[child], high[child + 3]);
            }
        });
    }
    return tree;
}

}  // namespace fracslice::mesh

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

namespace {

// The greatest cosine between the normals of the two faces of a wall, as in fracslice.printing.walls.
constexpr double kOpposite = -0.5;
// Parts of the limit: sides of triangles that have one ray, and of the parts of larger ones, which have one more at each corner.
constexpr double kSmall = 0.25, kPart = 0.5;
// The weights of a ray's corner and of the two others.
constexpr double kNear = 0.9, kFar = 0.05;
// The most parts along a side.
constexpr double kMost = 1 << 12;
// How far beside a triangle a ray still meets it, as a share of its sides: none passes between two.
constexpr double kBeside = 1e-9;

Vec3 corner(const MeshView& mesh, size_t t, int k) {
    const double* p = mesh.corner(t, k);
    return {p[0], p[1], p[2]};
}

// A triangle: a corner, its sides from there, and its normal, as long as twice the area.
struct Frame {
    Vec3 a, u, v, normal;

    Frame(const MeshView& mesh, size_t t)
        : a(corner(mesh, t, 0)), u(corner(mesh, t, 1) - a), v(corner(mesh, t, 2) - a), normal(cross(u, v)) {}

    double longest() const {
        const Vec3 w = v - u;
        return std::sqrt(std::max({dot(u, u), dot(v, v), dot(w, w)}));
    }
};

struct Hit {
    double length;
    size_t triangle;
};

class Rays {
  public:
    Rays(const MeshView& mesh, const TreeView& tree) : mesh_(mesh), tree_(tree) {}

    // The first triangle but `own` along a unit direction within `limit`; of that length if there is none.
    Hit first(const Vec3& from, const Vec3& along, double limit, size_t own) const {
        Hit hit{limit, own};
        size_t open[128] = {1};
        for (int height = 1; height > 0;) {
            const size_t node = open[--height];
            if (!passes(node, from, along, hit.length)) continue;
            if (node < tree_.leaves) {
                open[height++] = 2 * node, open[height++] = 2 * node + 1;
                continue;
            }
            const size_t leaf = node - tree_.leaves;
            for (size_t i = tree_.first(leaf); i < tree_.last(leaf); ++i) {
                const size_t t = size_t(tree_.order[i]);
                if (t == own) continue;
                if (double length = meets(t, from, along); length < hit.length) hit = {length, t};
            }
        }
        return hit;
    }

  private:
    bool passes(size_t node, const Vec3& from, const Vec3& along, double length) const {
        const double *low = tree_.low + 3 * node, *high = tree_.high + 3 * node;
        if (low[0] > high[0]) return false;  // empty
        double first = 0, last = length;
        for (size_t k = 0; k < 3; ++k) {
            if (along[k] == 0) {
                if (from[k] < low[k] || from[k] > high[k]) return false;
                continue;
            }
            const double p = (low[k] - from[k]) / along[k], q = (high[k] - from[k]) / along[k];
            first = std::max(first, std::min(p, q)), last = std::min(last, std::max(p, q));
        }
        return first <= last * (1 + kBeside);
    }

    // How far along the ray (Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997).
    double meets(size_t t, const Vec3& from, const Vec3& along) const {
        constexpr double never = std::numeric_limits<double>::infinity();
        const Frame sides(mesh_, t);
        const Vec3 p = cross(along, sides.v), way = from - sides.a, q = cross(way, sides.u);
        const double volume = dot(sides.u, p);
        if (volume == 0) return never;
        const double u = dot(way, p) / volume, v = dot(along, q) / volume, length = dot(sides.v, q) / volume;
        return u >= -kBeside && v >= -kBeside && u + v <= 1 + kBeside && length > 0 ? length : never;
    }

    const MeshView& mesh_;
    const TreeView& tree_;
};

bool neighbours(const MeshView& mesh, size_t t, size_t other) {
    const int32_t *a = mesh[t], *b = mesh[other];
    return std::any_of(a, a + 3, [&](int32_t v) { return std::find(b, b + 3, v) != b + 3; });
}

// The thinnest ray of a triangle; without area if none is thinner than the limit.
ThinWall thinnest(const MeshView& mesh, const Rays& rays, size_t t, double limit) {
    const Frame own(mesh, t);
    const double twice = std::sqrt(dot(own.normal, own.normal)), side = own.longest();
    ThinWall wall{limit};
    if (!(twice > 0)) return wall;
    const Vec3 inwards = (-1 / twice) * own.normal;
    const int parts = int(std::clamp(std::ceil(side / (kPart * limit)), 1.0, kMost)), rays_each = side > kSmall * limit ? 4 : 1;
    auto look = [&](double s, double r) {
        const Vec3 from = own.a + (s / parts) * own.u + (r / parts) * own.v;
        const Hit hit = rays.first(from, inwards, limit, t);
        if (hit.triangle == t || neighbours(mesh, t, hit.triangle)) return;
        const Vec3 other = Frame(mesh, hit.triangle).normal;
        if (dot(other, inwards) < -kOpposite * std::sqrt(dot(other, other))) return;
        wall[1] += twice / 2 / parts / parts / rays_each;
        if (hit.length >= wall[0]) return;
        const Vec3 middle = from + (hit.length / 2) * inwards;
        wall[0] = hit.length, wall[2] = middle[0], wall[3] = middle[1], wall[4] = middle[2];
    };
    // A part, from its corner where the sides meet, which go up or down.
    auto look_all = [&](int i, int j, int way) {
        look(i + way / 3.0, j + way / 3.0);
        if (rays_each == 1) return;
        look(i + way * kFar, j + way * kFar), look(i + way * kNear, j + way * kFar), look(i + way * kFar, j + way * kNear);
    };
    for (int i = 0; i < parts; ++i) {
        for (int j = 0; i + j < parts; ++j) {
            look_all(i, j, 1);
            if (i + j + 1 < parts) look_all(i + 1, j + 1, -1);
        }
    }
    return wall;
}

}  // namespace

std::vector<ThinWall> thin_walls(const MeshView& mesh, const TreeView& tree, size_t count, double limit) {
    const Rays rays(mesh, tree);
    return joined(in_blocks<std::vector<ThinWall>>(count, [&](size_t first, size_t last) {
        std::vector<ThinWall> found;
        for (size_t t = first; t < last; ++t) {
            if (const ThinWall wall = thinnest(mesh, rays, t, limit); wall[1] > 0) found.push_back(wall);
        }
        return found;
    }));
}

}  // namespace fracslice::mesh
