// How far other meshes are from one: proved, or sampled.
#pragma once
#include <span>
#include <vector>

#include "bound.h"

namespace fracslice::mesh {

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
