// The corners of triangles around each vertex, vertices in blocks: the triangles of each block are gathered, and their corners
// sorted where they are near. So all cores take part, and no memory is gone through at random.
#pragma once

#include <cassert>
#include <span>
#include <tbb/enumerable_thread_specific.h>
#include <vector>

#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

class Stars {
  public:
    explicit Stars(const Triangles& triangles);

    // The vertices of block k are first(k) to first(k + 1) - 1, and its corners start with number corners_before(k).
    size_t blocks() const { return starts_.size() - 1; }
    size_t first(size_t block) const { return std::min(block << shift_, triangles_.vertices); }
    size_t corners_before(size_t block) const { return corners_[block]; }

    // Calls act(v, corners) for the vertices of a block in turn; corner k of triangle t is 3 t + k, and they ascend.
    template <class Do>
    void for_each(size_t block, const Do& act) const {
        const size_t begin = first(block), count = first(block + 1) - begin;
        std::span<const uint32_t> all(own_.data.get() + starts_[block], starts_[block + 1] - starts_[block]);
        auto& [start, sorted] = scratch_.local();
        start.assign(count + 1, 0);
        sorted.resize(corners_[block + 1] - corners_[block]);
        auto within = [&](uint32_t t, size_t k) { return size_t(triangles_[t][k]) - begin; };  // below count in the block
        for (uint32_t t : all) {
            for (size_t k = 0; k < 3; ++k) {
                if (size_t v = within(t, k); v < count) ++start[v];
            }
        }
        for (size_t v = 0; v < count; ++v) start[v + 1] += start[v];
        assert(start[count] == sorted.size());
        for (size_t i = all.size(); i-- > 0;) {
            for (size_t k = 3; k-- > 0;) {
                if (size_t v = within(all[i], k); v < count) sorted[--start[v]] = 3 * int64_t(all[i]) + int64_t(k);
            }
        }
        for (size_t v = 0; v < count; ++v) act(begin + v, std::span<const int64_t>(sorted).subspan(start[v], start[v + 1] - start[v]));
    }

  private:
    struct Scratch {
        std::vector<uint32_t> start;
        std::vector<int64_t> sorted;
    };

    const Triangles triangles_;
    int shift_;                             // of a vertex to its block
    std::vector<size_t> starts_, corners_;  // where the triangles of a block start, how many corners are before; and the ends
    Array<uint32_t> own_;                   // the triangles that have a corner in a block
    mutable tbb::enumerable_thread_specific<Scratch> scratch_;
};

// --- How triangles hang together: the edges and fans around every vertex.

// Corners grouped by vertex; corner k of triangle t is 3 t + k.
struct CornersByVertex {
    Array<int64_t> start;   // [vertices + 1]
    Array<int64_t> corner;  // [3 count]
};

CornersByVertex corners_by_vertex(const Triangles& triangles);

// Sums over vertices. An edge is counted at both ends; non_manifold: of more than two triangles; misoriented: of triangles that
// traverse it in the same direction.
struct EdgeCounts {
    int64_t edges = 0, open = 0, non_manifold = 0, misoriented = 0, extra_fans = 0;
};

// At the vertices where counted is true: [vertices]. Triangles with two equal corners do not count.
EdgeCounts edge_counts(const Triangles& triangles, const bool* counted);

// --- A closed surface whose vertices can be taken out and put back: a corner table (Rossignac, "3D compression made simple:
// Edgebreaker on a corner-table", 2001) with a history. Corner k of triangle t is 3 t + k.

// The other corners of a triangle.
inline int32_t after(int32_t c) { return c % 3 == 2 ? c - 2 : c + 1; }
inline int32_t before(int32_t c) { return c % 3 == 0 ? c + 2 : c - 1; }

// Of each corner of a closed, oriented 2-manifold the one opposite, on the other side of the edge that it faces. Throws
// std::invalid_argument if one has none.
std::vector<int32_t> opposite_corners(const Triangles& triangles);

// Triangles around a vertex, at most.
constexpr int kDegree = 48;

// The triangles around a vertex in order: their corners there, and in each the vertex that follows.
struct Star {
    int count = 0;
    int32_t corner[kDegree], ring[kDegree];

    int32_t triangle(int i) const { return corner[i] / 3; }
    // Makes it begin at another triangle.
    void turn(int begin);
};

class CornerTable {
  public:
    // A closed, oriented 2-manifold.
    explicit CornerTable(const Triangles& triangles);

    const int32_t* triangles() const { return triangles_.data(); }
    // Of each triangle whether it is out, having been between a vertex and the one that it moved to.
    const std::vector<uint8_t>& gone() const { return gone_; }
    // The step, counted from 1, that changed a triangle last; 0 if it is as it was.
    int32_t changed_by(size_t t) const;
    // One corner of a vertex, -1 if it is out.
    int32_t corner(size_t v) const { return corner_[v]; }
    // The vertex that a step took out.
    int32_t vertex(int32_t step) const { return steps_[size_t(step) - 1].vertex; }
    bool stands(int32_t step) const { return steps_[size_t(step) - 1].stands; }

    // False if there are more than kDegree triangles.
    bool star(size_t v, Star& result) const;
    // Whether the vertex of a star may move to ring[i] and leave a manifold of the same topology: the two have two common
    // neighbours and no common triangle (the link condition; Dey, Edelsbrunner, Guha and Nekhayev, "Topology preserving edge
    // contraction", 1999).
    bool linked(const Star& star, int i) const;
    // Moves the vertex of a star to ring[0]; the first and the last of its triangles are out.
    void collapse(const Star& star);
    // A step that has to be undone before this one, because it changed something there later; itself if there is none.
    int32_t above(int32_t step) const;
    // Puts back the vertex of a step that none is above; returns its star as it was.
    Star undo(int32_t step);

  private:
    struct Step {
        int32_t vertex;
        int count;
        bool stands;
        size_t begin;  // in touched_ and before_, count + 2 of them
    };
    int32_t& at(int32_t c) { return triangles_[size_t(c)]; }
    int32_t at(int32_t c) const { return triangles_[size_t(c)]; }
    int32_t& across(int32_t c) { return across_[size_t(c)]; }
    int32_t across(int32_t c) const { return across_[size_t(c)]; }
    void touch(int32_t c);
    // Of what a step touched.
    auto touched(const Step& s) const { return touched_.begin() + std::ptrdiff_t(s.begin); }

    std::vector<int32_t> triangles_, across_, corner_;
    std::vector<int32_t> last_;  // of each triangle the step that touched it last
    std::vector<uint8_t> gone_;
    std::vector<Step> steps_;
    // The corners of a star and two opposite ones: the triangles that a step touched. And which step had done so before.
    std::vector<int32_t> touched_, before_;
};

}  // namespace fracslice::mesh
