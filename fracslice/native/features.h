// The vertices of a surface that lie in cells and in their faces: found brick by brick, then matched between neighbours.
#pragma once
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "array.h"
#include "near.h"

namespace fracslice {

// Where on its grid edge each of some crossings, `first` to `first + count - 1` as CellGrid numbers them, exactly lies, and
// the surface's unit normal there, [3, count].
struct Hermite {
    size_t first, count;
    const double* t;
    const float* normals;
    double margin;  // how near the ends of its edge a crossing may come

    double root(size_t vertex) const { return std::clamp(t[vertex - first], margin, 1 - margin); }

    Normal normal(size_t vertex) const {
        const float* n = normals + (vertex - first);
        return {n[0], n[count], n[2 * count]};
    }
};

// A vertex that is no crossing, and the case of its cell; where it lies in a face, of the upper cell there.
struct Feature {
    Vec3 point;
    uint8_t number;
};

// The features of a brick's cells: bit y*8 + z of slab x for each cell that has one, and for its lower face along each axis.
struct Features {
    Signs cells{};
    std::array<Signs, 3> corners{};
    Signs straight{};  // cells whose two corners say all that a tip would
    std::array<std::array<uint16_t, kSide>, 3> rank{};  // corners of this brick before that slab
    Feature* points = nullptr;                          // the corners by axis, then one a cell, in order
    uint32_t cell_count = 0, corner_count = 0, tip_count = 0;
    uint32_t loops = 0;  // triangles that these cells would have without corners
    size_t corner_base = 0, tip_base = 0, triangles = 0;
};

// Where a thread finds features and keeps them, until it is told that nobody needs them.
class FeatureStore {
  public:
    // Notes a feature in a cell's lower face along axis 0, 1 or 2, or in the cell (3).
    void add(int axis, const Feature& feature) { found_[axis][count_[axis]++] = feature; }

    // Keeps what was found in a brick and is ready for the next one.
    void keep(Features& of);

    void forget() { block_ = used_ = 0; }

  private:
    static constexpr size_t kBlock = size_t(1) << 14;
    std::array<std::array<Feature, kSamples>, 4> found_;
    std::array<size_t, 4> count_{};
    std::vector<Array<Feature>> blocks_;
    size_t block_ = 0, used_ = 0;
};

// The features of the bricks of a layer after the other: the points of the last three layers are kept.
class FeatureGrid {
  public:
    // For the features of some layers and, as these share corners with them, of the one before and the one after.
    FeatureGrid(const CellGrid& cells, Layers layers);

    // Finds the features of a layer's cells; those of the layers before it are known. data: crossings of this layer and the
    // next one.
    void find(int layer, const Hermite& data);

    // Finds out which corners of a layer are in two cells that both have a feature, and counts them. Its features and those
    // of the layer before it are known.
    void choose(int layer);

    // Finds out which cells of a layer need no tip, and counts triangles. Corners of the layer and of the next one are chosen.
    void straighten(int layer);

    Features& of(size_t brick) { return features_[near_.place_of(brick)]; }
    const Features& of(size_t brick) const { return features_[near_.place_of(brick)]; }

    // Those of the brick one step from brick i along an axis; null if the surface passes no cell of it.
    const Features* beside(size_t i, int axis, int step) const;

  private:
    using Stores = tbb::enumerable_thread_specific<FeatureStore>;

    const CellGrid& cells_;
    Span near_;
    std::vector<Features> features_;
    std::array<Stores, 3> stores_;
};

// The corners in all faces (axis*2 + upper) of a brick's cells that have a feature. A neighbour that is not there has none.
class Around {
  public:
    Around(const FeatureGrid& grid, size_t i);

    // The cells of slab x with a corner in that face.
    Slab at(int x, int face) const { return faces_[x][face]; }

    // A corner of a brick.
    struct Corner {
        const Features* owner;
        size_t index;

        const Vec3& point() const { return owner->points[index].point; }
        size_t vertex() const { return owner->corner_base + index; }
    };

    // The one in a face of the cell at that bit of slab x, where there is one.
    Corner corner(int x, int face, int bit) const {
        int axis = face / 2, at = x * 64 + bit, step = 64 >> 3 * axis;
        const Features* owner = own_;
        if (face % 2) {
            bool leaves = (at / step) % kSide == kSide - 1;
            at += leaves ? (1 - kSide) * step : step;
            if (leaves) owner = above_[axis];
        }
        Slab before = (Slab(1) << at % 64) - 1;
        return {owner, owner->rank[axis][at / 64] + size_t(popcount(owner->corners[axis][at / 64] & before))};
    }

  private:
    const Features* own_;
    std::array<const Features*, 3> above_;
    std::array<std::array<Slab, 6>, kSide> faces_;
};

// Calls act(brick) for the bricks of a span, in parallel.
template <class Do>
void for_each_brick(const Span& span, const Do& act) {
    tbb::parallel_for(size_t(0), span.size(), [&](size_t k) { act(span.brick(k)); });
}

}  // namespace fracslice
