// Segments on which a field has roots, as the loops of fracslice.mesh.root_loops take them.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace fracslice::mesh {

// A loop of fracslice.mesh.root_loops over n segments, a multiple of the lanes; `find` writes roots as fractions of them.
template <class Real>
using SegmentLoop = std::function<void(const Real* segments, Real* out, size_t n)>;

constexpr size_t kRows = 6;  // of a segment

// Some segments and their results; one per thread.
template <class Real>
struct Segments {
    std::vector<Real> rows, out;
    size_t count = 0, whole = 0;  // without and with those that fill the last lanes

    void resize(size_t n, size_t lanes) {
        count = n, whole = (n + lanes - 1) / lanes * lanes;
        rows.resize(kRows * whole);
        out.resize(5 * whole);
    }

    void pad() {
        for (size_t k = 0; k < kRows; ++k) {
            std::fill(&rows[k * whole] + count, &rows[k * whole] + whole, rows[k * whole + count - 1]);
        }
    }

    template <class From>
    void convert(const Segments<From>& from, size_t lanes) {
        resize(from.count, lanes);
        std::copy(from.rows.begin(), from.rows.end(), rows.begin());
    }

    // Takes some of others.
    void take(const Segments& from, const std::vector<uint32_t>& which, size_t lanes) {
        resize(which.size(), lanes);
        for (size_t k = 0; k < kRows; ++k) {
            for (size_t i = 0; i < count; ++i) rows[k * whole + i] = from.rows[k * from.whole + which[i]];
        }
        pad();
    }
};

}  // namespace fracslice::mesh
