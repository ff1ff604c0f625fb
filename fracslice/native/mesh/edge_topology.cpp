// Around vertex v each triangle is an arrow from its next corner to the one before. On a closed, oriented surface every
// neighbour of v then has one arrow in and one out, and all arrows form one ring.
#include "edge_topology.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "../disjoint_sets.h"
#include "stars.h"

namespace fracslice::mesh {
namespace {

// Counts at one vertex after the other.
class Fans {
  public:
    explicit Fans(const Triangles& triangles) : triangles_(triangles) {}

    // Of the triangles around a vertex those with three different corners count.
    void add(int32_t v, std::span<const int64_t> corners) {
        arrows_.clear();
        for (int64_t corner : corners) {
            const int32_t* t = triangles_[size_t(corner / 3)];
            int32_t from = t[(corner + 1) % 3], to = t[(corner + 2) % 3];
            if (from != to && from != v && to != v) arrows_.push_back({from, to});
        }
        if (arrows_.empty()) return;
        if (ring()) {
            counts.edges += int64_t(arrows_.size());
            return;
        }
        set_spokes();
        int64_t fans = int64_t(arrows_.size());
        for (size_t i = 0, j; i < spokes_.size(); i = j) {  // one neighbour after the other
            size_t outward = 0;
            for (j = i; j < spokes_.size() && spokes_[j] >> 32 == spokes_[i] >> 32; ++j) {
                outward += !(spokes_[j] & 1);
                fans -= j > i && DisjointSets<int32_t>(fan_).unite(corner(spokes_[i]), corner(spokes_[j]));
            }
            ++counts.edges;
            counts.open += j - i == 1;
            counts.non_manifold += j - i > 2;
            counts.misoriented += j - i > 1 && 2 * outward != j - i;
        }
        counts.extra_fans += fans - 1;
    }

    EdgeCounts counts;

  private:
    // Whether all arrows form one ring, as nearly everywhere: then nothing needs to be sorted.
    bool ring() const {
        int32_t first = arrows_[0].from, at = arrows_[0].to;
        size_t length = 1, degree = arrows_.size();
        for (; at != first && length < degree; ++length) {
            size_t next = 1;
            while (next < degree && arrows_[next].from != at) ++next;
            if (next == degree) return false;
            at = arrows_[next].to;
        }
        return at == first && length == degree;
    }

    // The two edges of each corner that meet at the vertex, by neighbour: neighbour, corner, whether inward, as one number.
    void set_spokes() {
        spokes_.resize(2 * arrows_.size());
        fan_.resize(arrows_.size());
        for (size_t i = 0; i < arrows_.size(); ++i) {
            spokes_[2 * i] = uint64_t(arrows_[i].from) << 32 | 2 * i;
            spokes_[2 * i + 1] = uint64_t(arrows_[i].to) << 32 | 2 * i | 1;
            fan_[i] = int32_t(i);
        }
        std::sort(spokes_.begin(), spokes_.end());
    }

    static int32_t corner(uint64_t spoke) { return int32_t(uint32_t(spoke) >> 1); }

    struct Arrow {
        int32_t from, to;
    };

    const Triangles& triangles_;
    std::vector<Arrow> arrows_;
    std::vector<uint64_t> spokes_;
    std::vector<int32_t> fan_;
};

EdgeCounts operator+(const EdgeCounts& a, const EdgeCounts& b) {
    return {a.edges + b.edges, a.open + b.open, a.non_manifold + b.non_manifold, a.misoriented + b.misoriented,
            a.extra_fans + b.extra_fans};
}

}  // namespace

CornersByVertex corners_by_vertex(const Triangles& triangles) {
    CornersByVertex result{{triangles.vertices + 1, 1}, {3 * triangles.count, 1}};
    int64_t *start = result.start.data.get(), *corner = result.corner.data.get();
    Stars stars(triangles);
    tbb::parallel_for(size_t(0), stars.blocks(), [&](size_t block) {
        size_t next = stars.corners_before(block);
        stars.for_each(block, [&](size_t v, std::span<const int64_t> corners) {
            start[v] = int64_t(next);
            std::copy(corners.begin(), corners.end(), corner + next);
            next += corners.size();
        });
    });
    start[triangles.vertices] = int64_t(3 * triangles.count);
    return result;
}

EdgeCounts edge_counts(const Triangles& triangles, const bool* counted) {
    Stars stars(triangles);
    return tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, stars.blocks(), 1), EdgeCounts(),
        [&](const tbb::blocked_range<size_t>& range, const EdgeCounts& before) {
            Fans fans(triangles);
            for (size_t block = range.begin(); block < range.end(); ++block) {
                stars.for_each(block, [&](size_t v, std::span<const int64_t> corners) {
                    if (counted[v]) fans.add(int32_t(v), corners);
                });
            }
            return before + fans.counts;
        },
        [](const EdgeCounts& a, const EdgeCounts& b) { return a + b; });
}

}  // namespace fracslice::mesh
