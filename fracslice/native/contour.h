#pragma once
#include "feature.h"
#include "marching_cubes.h"

namespace fracslice {

// The grid edges that the surface crosses, in the order of marching_cubes' vertices.
struct CrossedEdges {
    Array<int32_t> lower;  // [n, 3], their lower grid points ...
    Array<uint8_t> axis;   // [n], ... and directions
};

// Throws as marching_cubes does.
CrossedEdges crossed_edges(const Bricks& bricks);

// Where on its grid edge each vertex of marching_cubes, in its order, exactly lies, and the surface's unit normal there.
struct Hermite {
    const double* t;
    const double* normals;
    size_t count;
};

struct Contour {
    Array<double> vertices;    // [crossings + corners + tips, 3], origin + voxel * (grid position)
    Array<int32_t> triangles;  // [m, 3], counter-clockwise seen from outside
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
// Order and results follow from the arguments alone. Throws as marching_cubes does, and
// std::invalid_argument if there are not as many t as vertices.
Contour contour(const Bricks& bricks, const Hermite& data, const Placement& placement);

}  // namespace fracslice
