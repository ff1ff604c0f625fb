// Samples near capsules, and steps between samples: `fracslice.printing.bridging`.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "../volume/bricks.h"

namespace fracslice::printing {

// Start, direction vector and inverse squared length of an axis, voxels; 0 for a ball.
using Line = std::array<double, 7>;
using Place = std::array<double, 3>;

// Bricks of an index of this shape within `reach` voxels of the points.
std::vector<uint8_t> bricks_near(std::span<const Place> points, double reach, const std::array<int, 3>& shape);

// Least squared distances from samples to capsules within reach; of[m] is the axis of point m, which are at most a voxel apart.
// squares: [layout.count, 512], to be lowered.
void lower_squares(std::span<const Line> lines, std::span<const Place> points, std::span<const int32_t> of, double reach,
                   const volume::Layout& layout, float* squares);

// Grid steps from each sample to the nearest seed, at most 255, by breadth-first search over sampled bricks.
std::vector<uint8_t> steps_to(const volume::Layout& layout, const bool* seeds);

}  // namespace fracslice::printing
