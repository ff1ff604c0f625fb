// The corners of triangles around each vertex, vertices in blocks: each block's corners are gathered, then sorted where they
// are near. So all cores take part, and no memory is gone through at random.
#pragma once
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
    size_t first(size_t block) const { return std::min(block << shift_, vertices_); }
    size_t corners_before(size_t block) const { return starts_[block]; }

    // Calls act(v, corners) for the vertices of a block in turn; corner k of triangle t is 3 t + k, and they ascend.
    template <class Do>
    void for_each(size_t block, const Do& act) const {
        size_t begin = first(block), count = first(block + 1) - begin;
        std::span<const uint64_t> all(corners_.data.get() + starts_[block], starts_[block + 1] - starts_[block]);
        std::vector<uint32_t> start(count + 1, 0);
        for (uint64_t corner : all) ++start[corner >> kCornerBits];
        for (size_t v = 0; v < count; ++v) start[v + 1] += start[v];
        assert(start[count] == all.size());
        std::vector<int64_t> sorted(all.size());
        for (size_t i = all.size(); i-- > 0;) sorted[--start[all[i] >> kCornerBits]] = int64_t(all[i] & kCorner);
        for (size_t v = 0; v < count; ++v) act(begin + v, std::span<const int64_t>(sorted).subspan(start[v], start[v + 1] - start[v]));
    }

  private:
    static constexpr int kCornerBits = 34;
    static constexpr uint64_t kCorner = (uint64_t(1) << kCornerBits) - 1;

    size_t vertices_;
    int shift_;                    // of a vertex to its block
    std::vector<size_t> starts_;   // of the blocks, and behind the last
    Array<uint64_t> corners_;      // the vertex within its block, and the corner
};

}  // namespace fracslice::mesh
