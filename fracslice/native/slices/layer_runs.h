// Layers as runs of pixels: components, overlaps and what nothing supports; `fracslice.slicing.feature_graph`.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace fracslice::slices {

// Row y has the runs rows[y] to rows[y + 1] - 1, each of the pixels from its begin to its end, which is excluded.
struct LayerRuns {
    std::span<const int32_t> rows, begin, end;
    int width;

    int height() const { return int(rows.size()) - 1; }
};

struct OwnedRuns {
    std::vector<int32_t> rows{0}, begin, end;

    void add(int first, int last) { begin.push_back(first), end.push_back(last); }
    void end_row() { rows.push_back(int32_t(begin.size())); }
};

// The runs between runs.
OwnedRuns gaps(const LayerRuns& runs);

struct RunComponents {
    std::vector<int64_t> label;                 // of each run
    std::vector<int64_t> area;                  // of each component, pixels
    std::vector<std::array<double, 2>> middle;  // its centroid
    std::vector<uint8_t> open;                  // whether it reaches the border
};

// Connects runs that overlap, or at `reach` 1 touch at a corner.
RunComponents components(const LayerRuns& runs, int reach);

// Components of two layers, of the same rows, that share a pixel: pairs in ascending order.
std::vector<std::array<int64_t, 2>> overlaps(const LayerRuns& below, std::span<const int64_t> labels_below, const LayerRuns& above,
                                             std::span<const int64_t> labels_above);

// Pixels of a layer farther than `reach` pixels from all of the layer below.
OwnedRuns unsupported(const LayerRuns& below, const LayerRuns& above, double reach);

// Rows of pixels.
template <class T>
struct Image {
    int height, width;
    std::vector<T> pixels;

    Image(int rows, int columns, T value = {}) : height(rows), width(columns), pixels(size_t(rows) * size_t(columns), value) {}
    T* operator[](int y) { return pixels.data() + size_t(y) * size_t(width); }
    const T* operator[](int y) const { return pixels.data() + size_t(y) * size_t(width); }
};

template <class T>
struct ImageView {
    int height, width;
    const T* pixels;

    const T* operator[](int y) const { return pixels + size_t(y) * size_t(width); }
};

// Pixels of runs in each coarse pixel, which is `times` pixels across.
Image<int32_t> count_pixels(const LayerRuns& runs, int times);

// Coarse pixels with a row or a column that is solid, or in gaps empty, for at most `longest` pixels along x and y.
Image<uint8_t> narrow_pixels(const LayerRuns& runs, bool gaps, int times, const std::array<int64_t, 2>& longest);

// The part of a layer from row `top` and column `left` on.
Image<uint8_t> painted(const LayerRuns& runs, int top, int left, int height, int width);

// Distance of each pixel to the nearest one that is not of the region, 0 there; infinite if all are. Exact, between centres of
// pixels of this height and width.
Image<double> distances(const ImageView<bool>& region, double height, double width);

// Grey dilation with a cone, a square of an odd number of pixels.
Image<uint8_t> dilated(const ImageView<uint8_t>& image, const ImageView<double>& cone);

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
