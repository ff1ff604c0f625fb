// Pictures of layers in which widths are measured; `fracslice.slicing.thickness`, `fracslice.slicing.compensation`.
#pragma once
#include "layer_runs.h"

namespace fracslice::slices {

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
Image<int32_t> count_pixels(const Runs& runs, int times);

// Coarse pixels with a row or a column that is solid, or in gaps empty, for at most `longest` pixels along x and y.
Image<uint8_t> narrow_pixels(const Runs& runs, bool gaps, int times, const std::array<int64_t, 2>& longest);

// The part of a layer from row `top` and column `left` on.
Image<uint8_t> painted(const Runs& runs, int top, int left, int height, int width);

// Distance of each pixel to the nearest one that is not of the region, 0 there; infinite if all are. Exact, between centres of
// pixels of this height and width.
Image<double> distances(const ImageView<bool>& region, double height, double width);

// Grey dilation with a cone, a square of an odd number of pixels.
Image<uint8_t> dilated(const ImageView<uint8_t>& image, const ImageView<double>& cone);

}  // namespace fracslice::slices
