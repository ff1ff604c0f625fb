// Which shell of a mesh lies inside which.
#pragma once
#include <span>

#include "../array.h"
#include "triangles.h"

namespace fracslice::mesh {

struct Nesting {
    Array<int64_t> winding;  // how often others surround each shell
    Array<int64_t> parent;   // the smallest of these, or -1
};

// A ray from one vertex of each shell, first[shell], goes up and adds the winding of every triangle it passes; edges and
// vertices on the ray count once (half-open edges). Shells with -1 for a vertex are not looked at. labels: the shell of each
// vertex; sizes: the volume of each shell.
Nesting nesting(const MeshView& mesh, std::span<const int32_t> labels, std::span<const double> sizes,
                std::span<const int64_t> first);

}  // namespace fracslice::mesh
