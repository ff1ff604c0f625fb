// Components of layers as nodes and their overlaps as edges; `fracslice.slicing.feature_graph`.
#pragma once
#include "widths.h"

namespace fracslice::slices {

using Edge = std::array<int64_t, 2>;  // below, above

// Nodes that are not connected to a free one once the edges up to their layer are added. later: layer of each edge, ascending.
std::vector<uint8_t> closed_nodes(std::span<const Edge> edges, std::span<const int64_t> later, std::span<const int64_t> layer,
                                  std::span<const bool> free);

// Nodes that grow from some nodes; edges by layers.
std::vector<uint8_t> held_nodes(std::span<const Edge> edges, std::span<const int64_t> roots, size_t count);

// The cross-section that is smallest for what it carries.
struct WeakestCut {
    double contact = 0, carried = 0;  // areas
    int64_t cut = 0, node = -1;       // its largest node; -1 if there is none
};

// area, firm: of nodes; firm is 0 for islands. foot, least: carried areas that count on the plate, and above it. Cut k has the edges
// from starts[k] to starts[k + 1] - 1.
WeakestCut weakest_cut(std::span<const double> area, std::span<const double> firm, std::span<const Edge> edges,
                       std::span<const int64_t> starts, double foot, double least);

// Steps between the supported pixels on both sides of each pixel along a line of solid ones, to the right or up by dx, dy.
Image<float> spans(const ImageView<bool>& solid, const ImageView<bool>& held, int dy, int dx);

// Pixels that solid ones connect with held ones, by sides and corners; held ones are solid.
Image<uint8_t> connected_to(const ImageView<bool>& solid, const ImageView<bool>& held);

}  // namespace fracslice::slices
