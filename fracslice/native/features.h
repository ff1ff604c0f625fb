// The vertices of a surface that lie in cells and in their faces: found brick by brick, then matched between neighbours.
#pragma once
#include <tbb/parallel_for.h>

#include "array.h"
#include "near.h"

namespace fracslice {

// Where on its grid edge each of some crossings, in the order of CellGrid's numbers, exactly lies, and the surface's unit
// normal there, [3, count].
struct Hermite {
    const double* t;
    const float* normals;
    size_t count;
};

// A vertex that is no crossing, and corners of its cell near it: one inside, and 8 times one outside.
struct Feature {
    Vec3 point;
    uint8_t ends;
};

// The features of a brick's cells: bit y*8 + z of slab x for each cell with a tip, and for its lower face along each axis.
struct Features {
    Signs tips{};
    std::array<Signs, 3> corners{};
    std::array<std::array<uint16_t, kSide>, 3> rank{};  // corners of this brick before that slab
    Feature* points = nullptr;                          // the corners by axis, then the tips, in the order of their cells
    uint32_t count = 0;                                 // of these
    uint32_t corner_count = 0;
    uint32_t loops = 0;  // triangles that these cells would have without corners
    size_t tip_base = 0, corner_base = 0, triangles = 0;
};

// The crossings of some layers and of those around them, as CellGrid numbers them.
class Crossed {
  public:
    // Throws std::invalid_argument unless the data are those of the layers, of the one before and of the next two.
    Crossed(const CellGrid& cells, Layers layers, const Hermite& data, double margin);

    // Where a crossing lies on its grid edge, `margin` from its ends.
    double root(size_t vertex) const {
        double t = data_.t[vertex - first_];
        return t > margin_ ? (t < 1 - margin_ ? t : 1 - margin_) : margin_;
    }

    Normal normal(size_t vertex) const {
        const float* n = data_.normals + (vertex - first_);
        return {n[0], n[data_.count], n[2 * data_.count]};
    }

  private:
    Hermite data_;
    double margin_;
    size_t first_;
};

class FeatureGrid {
  public:
    // Finds the features of the cells in `layers` and of the corners that these share with the next layer.
    FeatureGrid(const CellGrid& cells, Layers layers, const Crossed& crossed, double margin);

    Features& of(size_t brick) { return features_[near_.place_of(brick)]; }
    const Features& of(size_t brick) const { return features_[near_.place_of(brick)]; }

    // Those of the brick one step from brick i along an axis; null if the surface passes no cell of it.
    const Features* beside(size_t i, int axis, int step) const;

    // Replaces counts by the sums of those before; returns the whole sums.
    template <class Member>
    size_t running_sum(Member member, const char* what) {
        return fracslice::running_sum(features_, member, what);
    }

  private:
    const CellGrid& cells_;
    Span near_;
    std::vector<Features> features_;
    std::vector<Array<Feature>> blocks_;
};

// Calls act(brick) for the bricks of a span, in parallel.
template <class Do>
void for_each_brick(const Span& span, const Do& act) {
    tbb::parallel_for(size_t(0), span.size(), [&](size_t k) { act(span.brick(k)); });
}

}  // namespace fracslice
