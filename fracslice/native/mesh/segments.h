// Segments on which a field has roots, as the loops of fracslice.mesh.root_loops take them.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace fracslice::mesh {

// Steps that all segments are given, and those that then are left.
struct Steps {
    size_t quick, most;
};

// A loop that finds roots on n segments, a multiple of the lanes, as fractions of them; more than 1 where it needs more steps.
template <class Real>
using Find = std::function<void(const Real* segments, Real* roots, size_t steps, size_t n)>;

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

    // Finds the roots; `left` is for those that take many steps.
    void find(const Find<Real>& function, const Steps& steps, size_t lanes, Segments& left, std::vector<uint32_t>& which) {
        function(rows.data(), out.data(), steps.quick, whole);
        which.clear();
        for (size_t i = 0; i < count; ++i) {
            if (out[i] > 1) which.push_back(uint32_t(i));
        }
        if (which.empty()) return;
        left.take(*this, which, lanes);
        function(left.rows.data(), left.out.data(), steps.most, left.whole);
        for (size_t i = 0; i < which.size(); ++i) out[which[i]] = left.out[i] > 1 ? left.out[i] - 2 : left.out[i];
    }
};

}  // namespace fracslice::mesh
