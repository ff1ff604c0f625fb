// Layers as runs of pixels: components, overlaps and what nothing supports; `fracslice.slicing.runs`.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace fracslice::slices {

// Row y has the runs rows[y] to rows[y + 1] - 1, each of the pixels from its begin to its end, which is excluded.
struct Runs {
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
OwnedRuns gaps(const Runs& runs);

struct RunComponents {
    std::vector<int64_t> label;                 // of each run
    std::vector<int64_t> area;                  // of each component, pixels
    std::vector<std::array<double, 2>> middle;  // its centroid
    std::vector<uint8_t> open;                  // whether it reaches the border
};

// Connects runs that overlap, or at `reach` 1 touch at a corner.
RunComponents components(const Runs& runs, int reach);

// Components of two layers, of the same rows, that share a pixel: pairs in ascending order.
std::vector<std::array<int64_t, 2>> overlaps(const Runs& below, std::span<const int64_t> labels_below, const Runs& above,
                                             std::span<const int64_t> labels_above);

// Pixels of a layer farther than `reach` pixels from all of the layer below.
OwnedRuns unsupported(const Runs& below, const Runs& above, double reach);

}  // namespace fracslice::slices
