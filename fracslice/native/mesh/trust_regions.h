// Boxes in which vertices that lie on no grid edge are projected to the surface.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "marching_cubes.h"

namespace fracslice::mesh {

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
