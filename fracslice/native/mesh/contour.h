#pragma once
#include "cells.h"
#include "features.h"
#include "marching_cubes.h"

namespace fracslice::mesh {

struct Contour {
    Array<double> vertices;    // [crossings + features, 3], origin + voxel * (grid position)
    Array<int32_t> triangles;  // [m, 3], counter-clockwise seen from outside
    Array<float> to_means;     // [features, 3], from each to the mean of the crossings around it, in voxels
    Array<uint8_t> cases;      // [features], of their cells, or of the upper cells at their faces: bits dx + 2 dy + 4 dz
    size_t crossings;
    std::vector<double> blunt;  // middles of cells that an edge or corner of the surface should be in but is not, x, y, z
};

// The surface between the samples < 0 and the others with its edges and corners kept, after Ho, Wu, Chen, Chuang and
// Ouhyoung 2005, "Cubical Marching Squares".
//
// A cell whose crossings' normals agree keeps the triangles of marching cubes. In one where they differ, and which has one
// loop of crossings, a tip is put where their planes meet and the loop becomes a fan around it; where the surface's trace
// in a face between two such cells has a corner, the loop goes over that corner. The surface stays a closed, oriented
// 2-manifold that does not cross itself, for the reasons marching_cubes.h gives and these:
// - A corner lies within its face and is a function of the face's two crossings, so the two cells agree on it; the trace
//   in that face stays a simple line from one crossing to the other.
// - The loop of such a cell is then a simple closed line on the surface of a convex body, the tip strictly inside it: a fan
//   of such a loop around such a point never meets itself.
// - Where the tip would lie on the line between the only two corners of its loop, it is left out and the fan is around one of
//   these. Of the loop just the two segments that end there lie in its face, so any other point of the loop is seen from it
//   through the inside of the body, each in a direction of its own.
//
// The surface is that in the cells of `layers`: pieces of neighbouring layers meet in equal points, and all pieces together
// are the whole. The first vertices are the crossings numbered by the bricks of these layers and of the next one.
//
// Order and results follow from the arguments alone.
class Contouring {
  public:
    Contouring(const CellGrid& cells, Layers layers, const Placement& placement);

    // Goes on to the layer before `end`; the first is the one before `layers`, as features take two layers to agree, and the
    // last the one after. data: the crossings of these layers and of the next one. Throws std::invalid_argument for others,
    // std::length_error past 2^31 vertices or triangles.
    void advance(int end, const Hermite& data);

    // The surface; once, after the last layer.
    Contour finish();

  private:
    void number_corners(int layer);
    void number_tips(int layer);
    size_t numbered(size_t count);
    void write_layer(int layer);
    void write_vertices(size_t i, const Hermite& data);
    void write_triangles(size_t i);
    void put(size_t vertex, const Vec3& point);
    void put_blunt(int layer);
    void put(size_t vertex, const Feature& feature);

    const CellGrid& cells_;
    Layers layers_;
    Placement placement_;
    FeatureGrid features_;
    int next_;
    size_t first_vertex_, known_;  // crossings of these layers and of the ones beside them
    Contour result_;
};

}  // namespace fracslice::mesh
