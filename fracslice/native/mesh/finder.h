// The features of one brick's cells.
#pragma once
#include "features.h"

namespace fracslice::mesh {

// Finds brick i's. data: the crossings that its cells have. along: whether their normals are all along their edges.
void find_features(const CellGrid& cells, const Hermite& data, size_t i, bool along, Features& own, FeatureStore& store);

}  // namespace fracslice::mesh
