// The vertices of a surface that lie in cells and in their faces: found brick by brick, then matched between neighbours.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "../array.h"
#include "cells.h"
#include "triangles.h"

// Where the planes through a cell's crossings meet.
namespace fracslice::mesh {

using Normal = std::array<float, 3>;

inline Normal operator-(const Normal& n) { return {-n[0], -n[1], -n[2]}; }
inline float dot(const Normal& a, const Normal& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// A crossing: where the surface meets an edge of the unit cell, and its normal there.
struct Crossing {
    Vec3 point, normal;
};

// Unit normals further apart than this (25 degrees) make a feature; Kobbelt et al. 2001 use the same.
constexpr double kSharp = 0.9;

// Whether a unit normal with these other two coordinates is along an axis, as float32 rounds it.
inline bool along_axis(float u, float v) { return std::abs(u) + std::abs(v) <= 1e-7f; }

// The cosine of half that angle: normals all nearer to one of them make none.
constexpr float kHalfSharp = 0.975f;

inline bool sharp(const Crossing& a, const Crossing& b) { return dot(a.normal, b.normal) < kSharp; }

// The point of the unit cell nearest to all the planes, in the least squares sense and no further from their points' mean
// than they ask for (Kobbelt, Botsch, Schwanecke and Seidel 2001, "Feature sensitive surface extraction"; the quadratic error
// of Garland and Heckbert 1997). The point lies strictly inside the cell, `margin` from its faces. Returns false where the
// planes do not meet in one point of the cell: then there is no feature but roughness.
bool feature_point(std::span<const Crossing> crossings, double margin, Vec3& point);

// Where the surface's trace in the cell's lower face along `axis` has its corner: the two crossings' tangents in the face
// intersected. Returns false where they do not meet within the face, `margin` from its edges.
bool face_corner(const Crossing& a, const Crossing& b, int axis, double margin, Vec3& corner);

// --- A brick with what the cells in it look at.

// Where Numbers holds the crossing on each edge of the cell at 0, 0, 0.
constexpr std::array<uint16_t, 12> make_places() {
    std::array<uint16_t, 12> places{};
    for (int e = 0; e < 12; ++e) places[e] = uint16_t(number_at(kEdges[e].axis, kEdges[e].dx, kEdges[e].dy, kEdges[e].dz));
    return places;
}
constexpr std::array<uint16_t, 12> kPlaces = make_places();

// A cell: its lower corner relative to its brick, and in grid units; its case; where Numbers holds its crossings.
struct Cell {
    int x, y, z;
    Vec3 lower;
    uint8_t number;
    const uint32_t* numbers;

    uint32_t at(int e) const { return numbers[kPlaces[e]]; }
    BitPlane bit() const { return BitPlane(1) << (y * 8 + z); }
};

// A brick's cells; its crossings are still to be numbered.
struct BrickCells {
    Octant octant;
    std::array<CornerPlanes, kSide + 1> corners;
    Numbers numbers;
    std::array<int, 3> first;  // its lowest grid point

    BrickCells(const CellGrid& cells, size_t i)
        : octant(cells.octant(i)), corners(corners_of(octant, cells.signs())), first(cells.place(i)) {
        for (int& k : first) k *= kSide;
    }

    // Calls visit(cell) for the cells that the surface passes.
    template <class Visit>
    void for_each(const Visit& visit) const {
        for_each_cell(corners, [&](int x, int y, int z, uint8_t number) { visit(cell(x, y, z, number)); });
    }

    // The same for some of plane x.
    template <class Visit>
    void for_each(int x, BitPlane cells, const Visit& visit) const {
        for_each_cell(corners[x], corners[x + 1], x, cells,
                      [&](int, int y, int z, uint8_t number) { visit(cell(x, y, z, number)); });
    }

  private:
    Cell cell(int x, int y, int z, uint8_t number) const {
        Vec3 lower = {double(first[0] + x), double(first[1] + y), double(first[2] + z)};
        return {x, y, z, lower, number, &numbers[number_at(0, x, y, z)]};
    }
};

// Where on its grid edge each of some crossings, `first` to `first + count - 1` as CellGrid numbers them, exactly lies, and
// the surface's unit normal there, in three rows of `stride` numbers.
struct Hermite {
    size_t first, count, stride;
    const double* t;
    const float* normals;
    double margin;  // how near the ends of its edge a crossing may come

    // Whether the normals of the crossings `begin` to `end` - 1 are along that axis.
    bool along(int axis, size_t begin, size_t end) const {
        const float *u = normals + (axis == 0 ? stride : 0), *v = normals + (axis == 2 ? 1 : 2) * stride;
        int others = 0;
        for (size_t k = begin - first; k < end - first; ++k) others |= !along_axis(u[k], v[k]);
        return !others;
    }

    double root(size_t vertex) const { return std::clamp(t[vertex - first], margin, 1 - margin); }

    Normal normal(size_t vertex) const {
        const float* n = normals + (vertex - first);
        return {n[0], n[stride], n[2 * stride]};
    }
};

// A vertex that is no crossing; the way from it to the mean of the crossings around it, zero where their planes are the axes';
// and the case of its cell, or where it lies in a face, of the upper cell there.
struct Feature {
    Vec3 point;
    std::array<float, 3> to_mean;
    uint8_t number;
};

// The features of a brick's cells: bit y*8 + z of plane x for each cell that has one, and for its lower face along each axis.
struct Features {
    Signs cells{};
    std::array<Signs, 3> corners{};
    Signs lined{};     // cells that lie in two planes, so that two corners say all that a tip would
    Signs straight{};  // cells whose two corners do say it
    Signs blunt{};     // cells whose normals differ, but where the edge or corner of the surface is not within
    std::array<std::array<uint16_t, kSide>, 3> rank{};  // corners of this brick before that plane
    std::array<Feature*, 4> result{};  // in lower faces along each axis, then one a cell, in order
    std::array<uint32_t, 4> counts{};
    uint32_t tip_count = 0;
    uint32_t loops = 0;  // triangles that these cells would have without corners
    std::array<size_t, 3> corner_base{};
    size_t tip_base = 0, triangles = 0;

    // Puts one in a cell, or in its lower face along axis 0, 1 or 2.
    void add(size_t kind, const Feature& feature) { result[kind][counts[kind]++] = feature; }
};

// Where a thread finds features and keeps them, until nobody needs them.
class FeatureStore {
  public:
    // Makes space for the features of a brick.
    void open(Features& of) {
        for (size_t kind = 0; kind < 4; ++kind) of.result[kind] = rows_[kind].space();
    }

    // Keeps those that were put there.
    void keep(const Features& of) {
        for (size_t kind = 0; kind < 4; ++kind) rows_[kind].used += of.counts[kind];
    }

    void forget() {
        for (Row& row : rows_) row.block = row.used = 0;
    }

  private:
    struct Row {
        std::vector<Array<Feature>> blocks;
        size_t block = 0, used = 0;

        Feature* space() {
            constexpr size_t size = size_t(1) << 14;
            if (used + kSamples > size) ++block, used = 0;
            if (block == blocks.size()) blocks.emplace_back(size, 1);
            return blocks[block].data.get() + used;
        }
    };

    std::array<Row, 4> rows_;
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

    // Notes in which bricks of a layer all normals are along their edges.
    void look(int layer, const Hermite& data);

    // Whether they are for all crossings that brick i's cells have.
    bool all_along(size_t i) const;

    const CellGrid& cells_;
    LayerBricks near_;
    std::vector<Features> features_;
    std::vector<uint8_t> along_;
    int looked_;  // the next layer to look at
    std::array<Stores, 3> stores_;
};

// The corners in all faces (axis*2 + upper) of a brick's cells that have a feature. A neighbour that is not there has none.
class Around {
  public:
    Around(const FeatureGrid& grid, size_t i);

    // The cells of plane x with a corner in that face.
    BitPlane at(int x, int face) const { return faces_[x][face]; }

    // A corner of a brick.
    struct Corner {
        const Features* owner;
        size_t axis, index;

        const Vec3& point() const { return owner->result[axis][index].point; }
        size_t vertex() const { return owner->corner_base[axis] + index; }
    };

    // The one in a face of the cell at that bit of plane x, where there is one.
    Corner corner(int x, int face, int bit) const {
        int axis = face / 2, at = x * 64 + bit, step = 64 >> 3 * axis;
        const Features* owner = own_;
        if (face % 2) {
            bool leaves = (at / step) % kSide == kSide - 1;
            at += leaves ? (1 - kSide) * step : step;
            if (leaves) owner = above_[axis];
        }
        BitPlane before = (BitPlane(1) << at % 64) - 1;
        return {owner, size_t(axis), owner->rank[axis][at / 64] + size_t(std::popcount(owner->corners[axis][at / 64] & before))};
    }

  private:
    const Features* own_;
    std::array<const Features*, 3> above_;
    std::array<std::array<BitPlane, 6>, kSide> faces_;
};

// Calls act(brick) for the bricks of some layers, in parallel.
template <class Do>
void for_each_brick(const LayerBricks& bricks, const Do& act) {
    tbb::parallel_for(size_t(0), bricks.size(), [&](size_t k) { act(bricks.brick(k)); });
}

// --- The features of one brick's cells.

// Finds brick i's. data: the crossings that its cells have. along: whether their normals are all along their edges.
void find_features(const CellGrid& cells, const Hermite& data, size_t i, bool along, Features& own, FeatureStore& store);

}  // namespace fracslice::mesh
