// The corners of triangles around each vertex, vertices in blocks: the triangles of each block are gathered, and their corners
// sorted where they are near. So all cores take part, and no memory is gone through at random.
#pragma once
#include <tbb/enumerable_thread_specific.h>

#include <cassert>
#include <span>

#include "../array.h"
#include "blocks.h"
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

}  // namespace fracslice::mesh
