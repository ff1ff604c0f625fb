// Connected components of a sampled solid and of the space around it: `fracslice.printing.components`.
#pragma once
#include <cstdint>
#include <vector>

#include "../array.h"
#include "../volume/bricks.h"

namespace fracslice::printing {

// Components, numbered from 0. Number 0 is the space that extends beyond the samples.
template <class Index>
struct SolidComponents {
    Array<Index> of;             // of the space beyond, of each sample, and of each unsampled brick in the order of the index
    std::vector<int64_t> sizes;  // samples
    std::vector<uint8_t> inside;
};

// Samples are connected along edges of the grid; an unsampled brick is connected as a whole. values: [layout.count, 512].
template <class Index, class Value>
SolidComponents<Index> solid_components(const volume::Layout& layout, const Value* values);

// Grid edges between samples of different signs, each counted for its inside component. labels: of samples, each below `count`.
template <class Index, class Value>
std::vector<int64_t> crossings_by_component(const volume::Layout& layout, const Value* values, const Index* labels, size_t count);

}  // namespace fracslice::printing
