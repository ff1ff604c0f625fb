#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "../array.h"
#include "../volume/signs.h"
#include "cells.h"
#include "features.h"

// Boxes in which vertices that lie on no grid edge are projected to the surface.

namespace fracslice::mesh {

using volume::Bricks;

struct Surface {
    Array<double> vertices;    // [n, 3], origin + voxel * (grid position)
    Array<int32_t> triangles;  // [m, 3], counter-clockwise seen from outside
};

struct Placement {
    std::array<double, 3> origin;
    double voxel;
    double minimum_edge_parameter;  // how near a grid point a vertex may come, as a share of the edge
};

// The surface between the samples < 0 and the others, by marching cubes with the table of make_cases.py.
//
// It is closed, an oriented 2-manifold, and does not cross itself, whatever the samples:
// - A face of a cell carries one segment for every pair of crossings that its four signs join; the two cells at the face
//   join the same ones, in opposite directions. So each segment borders exactly one disc of triangles in either cell.
// - Any other edge is a diagonal of one disc. It lies in no face, so no other cell has it, and the loops of one cell share
//   no crossing, so no other disc has it: two triangles meet there. Hence every edge has exactly two, oppositely directed.
// - Around a vertex there are the four cells of its grid edge. Each has one fan of triangles there, from the segment in one
//   of its faces to that in the next; the four fans close into one ring.
// - Vertices lie strictly within their grid edges, so a cell's triangles touch its faces in their segments and vertices
//   only, and within a cell the table's triangles do not cross. Rounding moves all points with equal coordinates alike.
// Cells in bricks without samples take part where the signs around a brick's edge or corner differ; closure sees to it that
// no crossing lies there, only triangles.
//
// The order of vertices and triangles follows from the bricks alone. Throws std::invalid_argument if a sign change leaves
// the samples or the arrays contradict each other, std::length_error past 2^31 vertices or triangles.
Surface marching_cubes(const Bricks& bricks, const Placement& placement);

// Features as Contour has them.
struct FeatureRows {
    const double* points;
    const float* to_means;
    const uint8_t* cases;
};

// Of some features, inside or not: the low and the high corner of the interior of the cell or face that each lies in, the
// nearest of its corners of the other sign, and the mean of the crossings around it, within the box. out: [4, 3, which.size()].
void trust_regions(const FeatureRows& features, std::span<const int64_t> which, std::span<const bool> inside,
                   const Placement& placement, double* out);

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
// 2-manifold that does not cross itself, for the reasons above and these:
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
