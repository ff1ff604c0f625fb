// Boxes in which vertices that lie on no grid edge are projected to the surface.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "../array.h"
#include "../volume/bricks.h"

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

}  // namespace fracslice::mesh
