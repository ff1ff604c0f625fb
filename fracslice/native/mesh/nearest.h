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
    // The same, or something whose distance has a square within a limit.
    Neighbour within(double limit, const double* p, size_t guess) const;

    // For each triangle a bound on how far its points are; infinite where one is farther than the tolerance, or that could not be
    // excluded. hints: of each corner a triangle here that may be near it, [count, 3], or empty. Returns what bounds depend on
    // besides: a triangle, and one here.
    using Pair = std::array<int32_t, 2>;
    std::vector<Pair> bounds(const MeshView& triangles, std::span<const int32_t> hints, double tolerance, double* distances) const;
    // The distance of each of the points [n, 3]. Runs of points that lie close together are fast.
    void points(std::span<const double> points, double* distances) const;
    // For each triangle how far its samples are at most: exactly, but for distances below `enough`. Samples are at most `spacing`
    // apart along its edges.
    void samples(const MeshView& triangles, double spacing, double enough, double* distances) const;

  private:
    // Squares of the distances to the box of a node, and to that of a triangle, which is faster than that to the triangle.
    double to_box(const double* p, size_t node) const;
    double to_box_of_triangle(const double* p, size_t t) const;
    // The triangles at most `reach` from a point, up to kMost.
    size_t around(const double* p, double reach, TriangleDistance* triangles) const;
    void run(std::span<const double> points, size_t& guess, double* distances) const;
    double sampled(const MeshView& triangles, size_t t, double spacing, double limit, size_t& guess) const;

    MeshView mesh_;
    TreeView tree_;
    std::vector<int32_t> across_;
};

}  // namespace fracslice::mesh
