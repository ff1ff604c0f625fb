#include "trust_regions.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace fracslice::mesh {
namespace {

// The corner of a cell, dx + 2 dy + 4 dz, that is fewest edges away from one and not of its sign; in the lower face across
// `face` if that is an axis.
int nearest_corner(unsigned face, unsigned number, unsigned from, bool inside) {
    int best = 0, least = 4;
    for (unsigned corner = 0; corner < 8; ++corner) {
        if ((face < 3 && (corner >> face & 1)) || (number >> corner & 1) == inside) continue;
        int away = std::popcount(corner ^ from);
        if (away < least) best = int(corner), least = away;
    }
    return best;
}

}  // namespace

void trust_regions(const FeatureRows& features, std::span<const int64_t> which, std::span<const bool> inside,
                   const Placement& placement, double* out) {
    assert(which.size() == inside.size());
    const size_t count = which.size();
    double voxel = placement.voxel, margin = placement.minimum_edge_parameter;
    for (size_t i = 0; i < count; ++i) {
        size_t row = size_t(which[i]);
        const double* point = features.points + 3 * row;
        unsigned face = 3, octant = 0;
        bool flat[3];
        double cell[3];
        for (unsigned k = 3; k-- > 0;) {
            double grid = (point[k] - placement.origin[k]) / voxel, whole = std::nearbyint(grid);
            flat[k] = std::abs(grid - whole) < margin / 2;
            cell[k] = flat[k] ? whole : std::floor(grid);
            octant |= unsigned(grid - cell[k] > 0.5) << k;
            if (flat[k]) face = k;
        }
        int corner = nearest_corner(face, features.cases[row], octant, inside[i]);
        for (size_t k = 0; k < 3; ++k) {
            double origin = placement.origin[k], *to = out + k * count + i;
            double low = flat[k] ? point[k] : origin + voxel * (cell[k] + margin);
            double high = flat[k] ? point[k] : origin + voxel * (cell[k] + (1 - margin));
            double middle = point[k] + double(float(voxel) * features.to_means[3 * row + k]);
            to[0] = low, to[3 * count] = high, to[6 * count] = origin + voxel * (cell[k] + (corner >> k & 1));
            to[9 * count] = std::min(std::max(middle, low), high);
        }
    }
}

}  // namespace fracslice::mesh
