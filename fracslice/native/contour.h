#pragma once
#include "cells.h"
#include "features.h"
#include "marching_cubes.h"

namespace fracslice {

struct Contour {
    Array<double> vertices;    // [crossings + corners + tips, 3], origin + voxel * (grid position)
    Array<int32_t> triangles;  // [m, 3], counter-clockwise seen from outside
    // [corners + tips]: corners of the cell of each, or of its face, near it: one inside, and 8 times one outside; corner
    // dx + 2 dy + 4 dz.
    Array<uint8_t> ends;
    size_t crossings, corners, tips;
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
//
// The surface is that in the cells of `layers`: pieces of neighbouring layers meet in equal points, and all pieces together
// are the whole. The first vertices are the crossings numbered by the bricks of these layers and of the next one. data: the
// crossings of these layers, of the one before and of the next two, for features take two layers to agree.
//
// Order and results follow from the arguments alone. Throws std::invalid_argument for other than so many crossings,
// std::length_error past 2^31 vertices or triangles.
Contour contour(const CellGrid& cells, Layers layers, const Hermite& data, const Placement& placement);

}  // namespace fracslice
