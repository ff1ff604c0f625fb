// Batch by batch, in memory that is used again. What is left after a few steps, or after the polish, is brought together and
// goes on by itself.
#include "roots.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace fracslice {
namespace {

constexpr size_t kRows = 6;  // of a segment

// Some segments and what is found on them; one thread's.
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
    template <class Find>
    void find(const Find& function, const RootLoops& loops, Segments& left, std::vector<uint32_t>& which) {
        function(rows.data(), out.data(), loops.quick, whole);
        which.clear();
        for (size_t i = 0; i < count; ++i) {
            if (out[i] > 1) which.push_back(uint32_t(i));
        }
        if (which.empty()) return;
        left.take(*this, which, loops.lanes);
        function(left.rows.data(), left.out.data(), loops.most, left.whole);
        for (size_t i = 0; i < which.size(); ++i) out[which[i]] = left.out[i] > 1 ? left.out[i] - 2 : left.out[i];
    }
};

class Search {
  public:
    void run(const CellGrid& cells, const RootLoops& loops, size_t begin, size_t end, const std::array<double, 3>& origin,
             double voxel, double* t, float* normals, size_t stride) {
        exact_.resize(end - begin, loops.lanes);
        cells.segments(begin, end, origin, voxel, exact_.whole, exact_.rows.data());
        exact_.pad();
        fast_.convert(exact_, loops.lanes);
        fast_.find(loops.guess, loops, fast_left_, which_);
        std::copy(fast_.out.begin(), fast_.out.begin() + ptrdiff_t(fast_.whole), exact_.out.begin());
        loops.polish(exact_.rows.data(), exact_.out.data(), exact_.whole);
        unsure_.clear();
        for (size_t i = 0; i < exact_.count; ++i) {
            t[i] = exact_.out[i];
            if (!(exact_.out[4 * exact_.whole + i] <= loops.sure)) unsure_.push_back(uint32_t(i));
        }
        for (size_t k = 0; k < 3; ++k) {
            const double* from = &exact_.out[(k + 1) * exact_.whole];
            std::copy(from, from + exact_.count, normals + k * stride);
        }
        if (!unsure_.empty()) again(loops, t, normals, stride);
    }

  private:
    void again(const RootLoops& loops, double* t, float* normals, size_t stride) {
        slow_.take(exact_, unsure_, loops.lanes);
        slow_.find(loops.find, loops, left_, which_);
        roots_.assign(slow_.out.begin(), slow_.out.begin() + ptrdiff_t(slow_.count));
        std::fill(&slow_.out[0] + slow_.count, &slow_.out[0] + slow_.whole, roots_.back());
        loops.polish(slow_.rows.data(), slow_.out.data(), slow_.whole);
        for (size_t i = 0; i < slow_.count; ++i) {
            size_t at = unsure_[i];
            t[at] = slow_.out[4 * slow_.whole + i] <= loops.sure ? slow_.out[i] : roots_[i];
            for (size_t k = 0; k < 3; ++k) normals[k * stride + at] = float(slow_.out[(k + 1) * slow_.whole + i]);
        }
    }

    Segments<double> exact_, slow_, left_;
    Segments<float> fast_, fast_left_;
    std::vector<uint32_t> which_, unsure_;
    std::vector<double> roots_;
};

}  // namespace

void find_crossings(const CellGrid& cells, const RootLoops& loops, size_t begin, size_t end,
                    const std::array<double, 3>& origin, double voxel, double* t, float* normals, size_t stride) {
    tbb::enumerable_thread_specific<Search> searches;
    size_t batches = (end - begin + loops.batch - 1) / loops.batch;
    tbb::parallel_for(size_t(0), batches, [&](size_t k) {
        size_t first = begin + k * loops.batch, last = std::min(first + loops.batch, end);
        searches.local().run(cells, loops, first, last, origin, voxel, t + (first - begin), normals + (first - begin), stride);
    });
}

}  // namespace fracslice
