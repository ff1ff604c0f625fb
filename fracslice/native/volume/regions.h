// Where few elements of a long union matter.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <limits>
#include <mutex>
#include <numeric>
#include <vector>

namespace fracslice::volume {

// P of loops over a field, which ends with lists of the elements of a union.
template <class Real>
struct Listing {
    struct List {
        size_t header;       // index of the number of elements; the index of the first one's numbers follows
        size_t count, size;  // elements, and numbers of each
    };
    using Points = void (*)(const Real*, const Real*, const Real*, const Real*, Real*, ptrdiff_t);

    Points points;
    std::vector<Real> parameters;
    std::vector<List> lists;

    size_t count() const {
        size_t all = 0;
        for (const List& list : lists) all += list.count;
        return all;
    }
    // Writes P with some elements alone, in order.
    void some(const uint32_t* live, size_t n, std::vector<Real>& out) const {
        size_t from = parameters.size(), before = 0;
        for (const List& list : lists) from -= list.count * list.size;
        out.assign(parameters.begin(), parameters.begin() + ptrdiff_t(from));
        const uint32_t* end = live + n;
        for (const List& list : lists) {
            const size_t place = out.size();
            size_t count = 0;
            for (; live < end && *live < before + list.count; ++live, ++count) {
                const Real* element = &parameters[from + (*live - before) * list.size];
                out.insert(out.end(), element, element + list.size);
            }
            out[list.header] = Real(count);
            out[list.header + 1] = Real(place);
            before += list.count;
            from += list.count * list.size;
        }
    }
};

// The field of a union is the least value of its elements. In a ball of radius r around c, an element whose value at c exceeds the
// least one by 2 L r is nowhere the least: P may leave it out, and no bit of the field changes. The cells of an octree, made when
// a point first falls into them, hold the elements that are left and their P.
template <class Real>
class Regions {
  public:
    using Bricks = void (*)(const Real*, Real, Real, Real, Real, const Real*, const Real*, const Real*, const int32_t*, Real*,
                            ptrdiff_t);
    using Point = std::array<double, 3>;

    // `alone`: the union without what its value is combined with, of slope `lipschitz`; `width`: lanes of the loops. Points outside
    // of the cube of half side `half` around `centre` see all elements.
    Regions(Listing<Real> whole, Bricks bricks, Listing<Real> alone, double lipschitz, const Point& centre, double half, size_t width)
        : whole_(std::move(whole)), alone_(std::move(alone)), bricks_(bricks), lipschitz_(lipschitz),
          width_(std::max<size_t>(width, 1)) {
        root_.centre = centre;
        root_.half = half;
        root_.live.resize(whole_.count());
        std::iota(root_.live.begin(), root_.live.end(), uint32_t(0));
        root_.parameters = whole_.parameters;
    }

    void points(const Real* x, const Real* y, const Real* z, Real* f, size_t n) const {
        for (size_t begin = 0; begin < n; begin += kPart) {
            const size_t count = std::min(kPart, n - begin);
            part(x + begin, y + begin, z + begin, f + begin, count);
        }
    }

    // See `expr.loops.bricks`.
    void bricks(Real ox, Real oy, Real oz, Real h, const Real* ix, const Real* iy, const Real* iz, const int32_t* corners, Real* f,
                size_t n) const {
        thread_local std::vector<uint32_t> live;
        thread_local std::vector<Real> parameters;
        const std::array<Real, 3> origin{ox, oy, oz};
        for (size_t b = 0; b < n; ++b) {
            Point lo, hi;
            for (int axis = 0; axis < 3; ++axis) {  // half a sample more on each side: the loop rounds
                lo[axis] = double(origin[axis]) + (corners[3 * b + axis] - 0.5) * double(h);
                hi[axis] = double(origin[axis]) + (corners[3 * b + axis] + 7.5) * double(h);
            }
            live.clear();
            const bool inside = root_.holds(lo) && root_.holds(hi);
            if (inside) {
                gather(root_, lo, hi, live);
                std::sort(live.begin(), live.end());
                live.erase(std::unique(live.begin(), live.end()), live.end());
                whole_.some(live.data(), live.size(), parameters);
            }
            const Real* p = inside ? parameters.data() : whole_.parameters.data();
            bricks_(p, ox, oy, oz, h, ix, iy, iz, corners + 3 * b, f + 512 * b, 1);
        }
    }

  private:
    struct Cell;

    // Points in a row, from `begin` to before `end`, that are in one cell.
    struct Streak {
        const Cell* cell;
        uint32_t begin, end;
    };

    // Points of one cell are evaluated together.
    void part(const Real* x, const Real* y, const Real* z, Real* f, size_t n) const {
        thread_local std::vector<Streak> streaks;
        streaks.clear();
        const Cell* cell = &root_;
        for (size_t i = 0; i < n; ++i) {
            const Point p{double(x[i]), double(y[i]), double(z[i])};
            if (cell == &root_ || !cell->holds(p)) cell = leaf(p, *cell);
            if (streaks.empty() || streaks.back().cell != cell) streaks.push_back({cell, uint32_t(i), uint32_t(i)});
            ++streaks.back().end;
        }
        if (streaks.size() * kGrain > n)
            std::sort(streaks.begin(), streaks.end(), [](const Streak& a, const Streak& b) {
                return a.cell != b.cell ? std::less<>()(a.cell, b.cell) : a.begin < b.begin;
            });
        for (size_t begin = 0, end; begin < streaks.size(); begin = end) {
            for (end = begin + 1; end < streaks.size() && streaks[end].cell == streaks[begin].cell;) ++end;
            some(&streaks[begin], end - begin, x, y, z, f);
        }
    }

    static constexpr size_t kPart = size_t(1) << 14;  // points that are ordered at a time
    static constexpr size_t kFew = 48;     // elements of a leaf
    static constexpr int kDeepest = 9;    // levels of cells
    static constexpr int kStuck = 5;      // levels without use, after which a cell is not divided
    static constexpr size_t kGrain = 16;  // points in a row, of one cell on the average, that need not be sorted

    struct Cell {
        Point centre{};
        double half = 0;
        int level = 0, stuck = 0;  // `stuck`: levels above it that left out few elements
        const Cell* above = nullptr;
        std::vector<uint32_t> live;
        std::vector<Real> parameters;  // of a leaf
        mutable std::atomic<const Cell*> children{nullptr};  // eight

        bool holds(const Point& p) const {
            return std::abs(p[0] - centre[0]) < half && std::abs(p[1] - centre[1]) < half && std::abs(p[2] - centre[2]) < half;
        }
        bool is_leaf() const { return level == kDeepest || live.size() <= kFew || stuck == kStuck; }
    };

    // The leaf of a point, near that of another one; the root, which lists all elements, for points outside.
    const Cell* leaf(const Point& p, const Cell& near) const {
        const Cell* cell = &near;
        while (!cell->holds(p)) {
            if (!cell->above) return cell;
            cell = cell->above;
        }
        while (!cell->is_leaf()) {
            size_t k = 0;
            for (int axis = 0; axis < 3; ++axis) k |= size_t(p[axis] >= cell->centre[axis]) << axis;
            cell = children(*cell) + k;
        }
        return cell;
    }

    void gather(const Cell& cell, const Point& lo, const Point& hi, std::vector<uint32_t>& live) const {
        if (cell.is_leaf()) {
            live.insert(live.end(), cell.live.begin(), cell.live.end());
            return;
        }
        const Cell* eight = children(cell);
        for (size_t k = 0; k < 8; ++k) {
            bool apart = false;
            for (int axis = 0; axis < 3; ++axis) {
                apart = apart || lo[axis] > eight[k].centre[axis] + eight[k].half || hi[axis] < eight[k].centre[axis] - eight[k].half;
            }
            if (!apart) gather(eight[k], lo, hi, live);
        }
    }

    const Cell* children(const Cell& cell) const {
        if (const Cell* made = cell.children.load(std::memory_order_acquire)) return made;
        std::lock_guard guard(locks_[size_t(&cell) / sizeof(Cell) % locks_.size()]);
        if (const Cell* made = cell.children.load(std::memory_order_relaxed)) return made;
        const Cell* made = divide(cell);
        cell.children.store(made, std::memory_order_release);
        return made;
    }

    // Values of each element alone at the centres of the eight parts decide which of them lists it.
    const Cell* divide(const Cell& cell) const {
        const size_t lanes = (8 + width_ - 1) / width_ * width_;
        const double half = cell.half / 2;
        std::vector<Real> rows(4 * lanes), parameters;
        std::vector<Real> values(8 * cell.live.size());
        for (size_t k = 0; k < lanes; ++k) {
            for (int axis = 0; axis < 3; ++axis) {
                rows[axis * lanes + k] = Real(cell.centre[axis] + (k % 8 >> axis & 1 ? half : -half));
            }
        }
        for (size_t i = 0; i < cell.live.size(); ++i) {
            alone_.some(&cell.live[i], 1, parameters);
            Real* f = &rows[3 * lanes];
            alone_.points(parameters.data(), &rows[0], &rows[lanes], &rows[2 * lanes], f, ptrdiff_t(lanes));
            std::copy_n(f, 8, &values[8 * i]);
        }
        std::array<Cell, 8>* eight;
        {
            std::lock_guard guard(store_);
            eight = &cells_.emplace_back();
        }
        for (size_t k = 0; k < 8; ++k) {
            Cell& part = (*eight)[k];
            part.level = cell.level + 1;
            part.above = &cell;
            part.half = half;
            double least = std::numeric_limits<double>::infinity(), size = std::abs(half);
            for (int axis = 0; axis < 3; ++axis) {
                part.centre[axis] = cell.centre[axis] + (k >> axis & 1 ? half : -half);
                size = std::max(size, std::abs(part.centre[axis]));
            }
            for (size_t i = 0; i < cell.live.size(); ++i) least = std::min(least, double(values[8 * i + k]));
            // Beyond the corners of the cell, as points on its faces are rounded; then what values are rounded by.
            const double reach = 2 * lipschitz_ * std::sqrt(3.0) * half * 1.001;
            const double rounding = 4096 * double(std::numeric_limits<Real>::epsilon()) * (size * lipschitz_ + std::abs(least));
            for (size_t i = 0; i < cell.live.size(); ++i) {
                if (!(double(values[8 * i + k]) > least + reach + rounding)) part.live.push_back(cell.live[i]);
            }
            part.stuck = part.live.size() * 4 > cell.live.size() * 3 ? cell.stuck + 1 : 0;
            if (part.is_leaf()) whole_.some(part.live.data(), part.live.size(), part.parameters);
        }
        return eight->data();
    }

    // Points of some streaks in one cell.
    void some(const Streak* streaks, size_t count, const Real* x, const Real* y, const Real* z, Real* f) const {
        thread_local std::vector<Real> rows;
        size_t n = 0;
        for (size_t k = 0; k < count; ++k) n += streaks[k].end - streaks[k].begin;
        const size_t lanes = (n + width_ - 1) / width_ * width_;
        rows.resize(4 * lanes);
        const std::array<const Real*, 3> given{x, y, z};
        for (int axis = 0; axis < 3; ++axis) {
            Real* row = &rows[axis * lanes];
            for (size_t k = 0; k < count; ++k) row = std::copy(given[axis] + streaks[k].begin, given[axis] + streaks[k].end, row);
            std::fill(row, &rows[axis * lanes] + lanes, row[-1]);
        }
        const std::vector<Real>& parameters = streaks->cell->parameters;
        whole_.points(parameters.data(), &rows[0], &rows[lanes], &rows[2 * lanes], &rows[3 * lanes], ptrdiff_t(lanes));
        const Real* made = &rows[3 * lanes];
        for (size_t k = 0; k < count; ++k) {
            const size_t own = streaks[k].end - streaks[k].begin;
            std::copy_n(made, own, f + streaks[k].begin);
            made += own;
        }
    }

    Listing<Real> whole_, alone_;
    Bricks bricks_;
    double lipschitz_;
    size_t width_;
    Cell root_;
    mutable std::deque<std::array<Cell, 8>> cells_;
    mutable std::mutex store_;
    mutable std::array<std::mutex, 64> locks_;
};

// Loops with the arguments of the compiled ones, whose P holds the address of regions.
template <class Real>
const Regions<Real>& regions_at(const Real* p) {
    const Regions<Real>* regions;
    std::memcpy(&regions, p, sizeof regions);
    return *regions;
}

template <class Real>
void points_in_regions(const Real* p, const Real* x, const Real* y, const Real* z, Real* f, ptrdiff_t n) {
    regions_at(p).points(x, y, z, f, size_t(n));
}

template <class Real>
void bricks_in_regions(const Real* p, Real ox, Real oy, Real oz, Real h, const Real* ix, const Real* iy, const Real* iz,
                       const int32_t* corners, Real* f, ptrdiff_t n) {
    regions_at(p).bricks(ox, oy, oz, h, ix, iy, iz, corners, f, size_t(n));
}

}  // namespace fracslice::volume
