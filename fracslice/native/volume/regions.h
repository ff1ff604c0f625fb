// Where few elements of a long union matter.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <mutex>
#include <vector>

namespace fracslice::volume {

// Numbers up to a bound, each once, in order.
class Ordered {
  public:
    explicit Ordered(size_t bound) : words_((bound + 63) / 64), used_((words_.size() + 63) / 64) {}

    void insert(uint32_t number) {
        words_[number / 64] |= uint64_t(1) << number % 64;
        used_[number / 4096] |= uint64_t(1) << number / 64 % 64;
    }
    // Appends them to `out`, and leaves none.
    void take(std::vector<int32_t>& out) {
        for (size_t block = 0; block < used_.size(); ++block) {
            for (; used_[block]; used_[block] &= used_[block] - 1) {
                const size_t word = 64 * block + size_t(std::countr_zero(used_[block]));
                for (uint64_t& bits = words_[word]; bits; bits &= bits - 1) {
                    out.push_back(int32_t(64 * word + size_t(std::countr_zero(bits))));
                }
            }
        }
    }

  private:
    std::vector<uint64_t> words_, used_;  // bits of the numbers, and of the words that are not zero
};

// The elements of a union, one by one.
struct Elements {
    using Points = void (*)(const double*, const double*, const double*, const double*, double*, ptrdiff_t);

    Points points;          // the loop "points" over the field of one
    const double* numbers;  // P of each
    size_t count, size;
    size_t width;      // lanes of the loop
    double smooth;     // width of the seams
    double lipschitz;  // of the union
};

// A union folds its elements one after the other. In a ball of radius r around c, where f is what is folded so far: an element whose
// value at c exceeds f by more than the width of a seam and 2 L r is above the seam everywhere in the ball, and changes no bit; one
// that is below f by as much makes what was before it change none. Seams of width 0 may be folded in any order. The cells of an
// octree, made when they are first asked for, list the elements that are left. More than these may be folded as well. (Values of
// parts of a tree at the centre of a cell, and L: Barbier et al. 2025, "Lipschitz Pruning".)
class Regions {
  public:
    using Point = std::array<double, 3>;

    // Points outside of the cube of half side `half` around `centre` see all elements.
    Regions(const Elements& elements, const Point& centre, double half) : elements_(elements) {
        root_.centre = centre;
        root_.half = half;
        root_.list.resize(elements.count + 1);
        root_.list[0] = int32_t(elements.count);
        for (size_t k = 0; k < elements.count; ++k) root_.list[k + 1] = int32_t(k);
    }

    // The number of elements that matter at points, then these; valid until the thread's next question to any regions.
    template <class Real>
    const int32_t* at_points(const Real* points, size_t count) const {
        Recent& recent = recent_of_thread();
        if (recent.window.spans(points, count)) return recent.answer;
        recent.found.clear();
        const Cell* cell = recent.cell;
        for (size_t i = 0; i < count; ++i) {
            const Point p{double(points[i]), double(points[count + i]), double(points[2 * count + i])};
            if (std::isnan(p[0] + p[1] + p[2])) continue;
            if (cell == &root_ || !cell->holds(p)) cell = leaf(p, *cell);
            if (recent.found.empty() || recent.found.back() != cell) recent.found.push_back(cell);
        }
        recent.cell = cell;
        return recent.answered();
    }

    // The same for points of a brick, of which the corners come first.
    template <class Real>
    const int32_t* in_brick(const Real* points, size_t count) const {
        Recent& recent = recent_of_thread();
        if (recent.window.spans(points, count)) return recent.answer;
        Window box;
        double extent = 0;
        for (size_t axis = 0; axis < 3; ++axis) {
            const auto [least, most] = std::minmax_element(points + axis * count, points + (axis + 1) * count);
            box.lo[axis] = double(*least), box.hi[axis] = double(*most);
            extent = std::max(extent, box.hi[axis] - box.lo[axis]);
        }
        for (size_t axis = 0; axis < 3; ++axis) box.lo[axis] -= kMargin * extent, box.hi[axis] += kMargin * extent;
        // Least and most may be those of numbers that are none; a brick may be torn apart, by a repeat.
        if (!box.spans(points, count) || !root_.holds(box.lo) || !root_.holds(box.hi)) return at_points(points, count);
        recent.cell = leaf(box.lo, *recent.cell);
        if (extent > kWide * recent.cell->half) return at_points(points, count);
        recent.found.clear();
        gather(root_, box.lo, box.hi, kFine * extent, recent.found);
        const int32_t* answer = recent.answered();
        if (recent.found.size() > 1) recent.window = box;
        return answer;
    }

    // The same for boxes: the least coordinates, then the largest ones.
    template <class Real>
    const int32_t* in_boxes(const Real* ends, size_t count) const {
        Recent& recent = recent_of_thread();
        recent.found.clear();
        for (size_t i = 0; i < count; ++i) {
            Point lo, hi;
            for (size_t axis = 0; axis < 3; ++axis) {
                lo[axis] = double(ends[axis * count + i]);
                hi[axis] = double(ends[(3 + axis) * count + i]);
            }
            if (root_.holds(lo) && root_.holds(hi)) {
                gather(root_, lo, hi, hi[0] - lo[0], recent.found);
            } else {
                recent.found.push_back(&root_);
            }
        }
        return recent.answered();
    }

  private:
    static constexpr size_t kFew = 16;   // elements of a leaf, while few cells are divided
    static constexpr int kDeepest = 10;  // levels of cells
    static constexpr int kStuck = 5;     // levels without use, after which a cell is not divided
    // Width of a seam, in twice the radii of a cell, from which on it is not divided: smaller cells would list about as many.
    static constexpr double kSeam = 4;
    // Cells that are divided at most, and more for each element: a division takes about two kilobytes.
    static constexpr size_t kDivided = 1 << 14, kEach = 2;
    static constexpr double kWide = 32;  // extent of a brick, in half sides of a leaf, up to which it is asked for as a whole
    // Of a brick, in its extents: beyond its corners, as its points are rounded; cells that need not be divided.
    static constexpr double kMargin = 0.02, kFine = 0.5;

    struct Cell {
        Point centre{};
        double half = 0;
        int level = 0, stuck = 0;  // `stuck`: levels above it that left out few elements
        const Cell* above = nullptr;
        std::vector<int32_t> list = {0};                     // the number of elements, and these
        mutable std::atomic<const Cell*> children{nullptr};  // eight

        bool holds(const Point& p) const {
            return std::abs(p[0] - centre[0]) < half && std::abs(p[1] - centre[1]) < half && std::abs(p[2] - centre[2]) < half;
        }
    };

    // A box; at first of nothing.
    struct Window {
        Point lo{1, 1, 1}, hi{-1, -1, -1};

        // Whether no lane is outside; what is no number is nowhere.
        template <class Real>
        bool spans(const Real* points, size_t count) const {
            int outside = 0;
            for (size_t axis = 0; axis < 3; ++axis) {
                const Real least = Real(lo[axis]), most = Real(hi[axis]);
                for (size_t i = axis * count; i < (axis + 1) * count; ++i) outside |= (points[i] <= least) | (points[i] >= most);
            }
            return !outside;
        }
    };

    // What a thread asked last.
    struct Recent {
        uint64_t number = 0;
        const Cell* cell = nullptr;       // of a point
        Window window;                    // where the answer holds
        const int32_t* answer = nullptr;  // the number of elements, and these
        std::vector<const Cell*> found, joined;
        std::vector<int32_t> list;  // elements of the cells that are joined
        Ordered ordered{0};

        // The elements of the cells found.
        const int32_t* answered() {
            window = {};
            if (found.size() == 1) {
                const Cell& cell = *found[0];
                if (cell.above) {
                    for (size_t axis = 0; axis < 3; ++axis) {
                        window.lo[axis] = cell.centre[axis] - cell.half;
                        window.hi[axis] = cell.centre[axis] + cell.half;
                    }
                }
                return answer = cell.list.data();
            }
            std::sort(found.begin(), found.end(), std::less<>());
            found.erase(std::unique(found.begin(), found.end()), found.end());
            if (found != joined) join();
            return answer = list.data();
        }
        void join() {
            list.assign(1, 0);
            for (const Cell* cell : found) {
                for (size_t k = 1; k < cell->list.size(); ++k) ordered.insert(uint32_t(cell->list[k]));
            }
            ordered.take(list);
            list[0] = int32_t(list.size() - 1);
            joined = found;
        }
    };

    Recent& recent_of_thread() const {
        thread_local std::array<Recent, 4> recents;
        Recent& recent = recents[number_ % recents.size()];
        if (recent.number != number_) {
            recent.window = {};
            recent.joined.clear();
            recent.list = {0};
            recent.answer = recent.list.data();
            recent.number = number_;
            recent.cell = &root_;
            recent.ordered = Ordered(elements_.count);
        }
        return recent;
    }

    // The leaf of a point, near that of another one; the root, which lists all elements, for points outside.
    const Cell* leaf(const Point& p, const Cell& near) const {
        const Cell* cell = &near;
        while (!cell->holds(p)) {
            if (!cell->above) return cell;
            cell = cell->above;
        }
        while (const Cell* eight = children(*cell)) {
            size_t k = 0;
            for (int axis = 0; axis < 3; ++axis) k |= size_t(p[axis] >= cell->centre[axis]) << axis;
            cell = eight + k;
        }
        return cell;
    }

    // Cells that cover a box: leaves, or those of a side `enough` at most.
    void gather(const Cell& cell, const Point& lo, const Point& hi, double enough, std::vector<const Cell*>& found) const {
        const Cell* eight = 2 * cell.half <= enough ? nullptr : children(cell);
        if (!eight) {
            found.push_back(&cell);
            return;
        }
        for (size_t k = 0; k < 8; ++k) {
            bool apart = false;
            for (int axis = 0; axis < 3; ++axis) {
                apart = apart || lo[axis] > eight[k].centre[axis] + eight[k].half || hi[axis] < eight[k].centre[axis] - eight[k].half;
            }
            if (!apart) gather(eight[k], lo, hi, enough, found);
        }
    }

    // The eight parts of a cell; none of a leaf.
    const Cell* children(const Cell& cell) const {
        if (const Cell* made = cell.children.load(std::memory_order_acquire)) return made;
        if (cell.level == kDeepest || cell.stuck == kStuck || cell.list.size() <= most_of_leaf() + 1) return nullptr;
        std::lock_guard guard(locks_[size_t(&cell) / sizeof(Cell) % locks_.size()]);
        if (const Cell* made = cell.children.load(std::memory_order_relaxed)) return made;
        const Cell* made = divide(cell);
        cell.children.store(made, std::memory_order_release);
        return made;
    }

    // Elements of a leaf. The more cells are divided, the more: what is asked of a dense smooth union would take any memory.
    size_t most_of_leaf() const {
        const size_t quarter = 4 * divided_.load(std::memory_order_relaxed) / (kDivided + kEach * elements_.count);
        return quarter < 4 ? kFew << quarter : elements_.count;
    }

    const Cell* divide(const Cell& cell) const {
        const double half = cell.half / 2;
        const bool is_fine = elements_.smooth > kSeam * across(half);
        const std::vector<double> values = values_at_centres(cell);
        std::array<Cell, 8>* eight;
        {
            std::lock_guard guard(store_);
            eight = &cells_.emplace_back();
        }
        divided_.fetch_add(1, std::memory_order_relaxed);
        for (size_t k = 0; k < 8; ++k) {
            Cell& part = (*eight)[k];
            part.level = cell.level + 1;
            part.above = &cell;
            part.half = half;
            for (int axis = 0; axis < 3; ++axis) part.centre[axis] = cell.centre[axis] + (k >> axis & 1 ? half : -half);
            choose(cell.list, &values[k], part);
            part.stuck = is_fine ? kStuck : part.list.size() * 4 > cell.list.size() * 3 ? cell.stuck + 1 : 0;
        }
        return eight->data();
    }

    // What values of the union differ by in a cell, at most.
    double across(double half) const { return 2 * elements_.lipschitz * std::sqrt(3.0) * half; }

    // Values of each element of a cell alone at the centres of its eight parts.
    std::vector<double> values_at_centres(const Cell& cell) const {
        const size_t lanes = (8 + elements_.width - 1) / elements_.width * elements_.width;
        std::vector<double> rows(4 * lanes), values(8 * (cell.list.size() - 1));
        for (size_t k = 0; k < lanes; ++k) {
            for (int axis = 0; axis < 3; ++axis) {
                rows[axis * lanes + k] = cell.centre[axis] + (k % 8 >> axis & 1 ? 0.5 : -0.5) * cell.half;
            }
        }
        for (size_t i = 1; i < cell.list.size(); ++i) {
            const double* p = elements_.numbers + elements_.size * size_t(cell.list[i]);
            elements_.points(p, &rows[0], &rows[lanes], &rows[2 * lanes], &rows[3 * lanes], ptrdiff_t(lanes));
            std::copy_n(&rows[3 * lanes], 8, &values[8 * (i - 1)]);
        }
        return values;
    }

    // Lists the elements of `from` that matter in a cell; `values`: theirs at its centre, eight apart.
    void choose(const std::vector<int32_t>& from, const double* values, Cell& cell) const {
        const size_t count = from.size() - 1;
        const double seam = elements_.smooth, lipschitz = elements_.lipschitz;
        double least = std::numeric_limits<double>::infinity(), size = std::abs(cell.half);
        for (size_t i = 0; i < count; ++i) least = std::min(least, values[8 * i]);
        for (int axis = 0; axis < 3; ++axis) size = std::max(size, std::abs(cell.centre[axis]));
        // Beyond the corners of the cell, as points on its faces are rounded; then what values are rounded by, in float32 at most.
        const double rounding = 4096.0 * std::numeric_limits<float>::epsilon() * (size * lipschitz + std::abs(least) + seam);
        const double apart = seam + across(cell.half) * 1.001 + rounding;
        double f = seam > 0 ? std::numeric_limits<double>::infinity() : least;
        cell.list.assign(1, 0);
        for (size_t i = 0; i < count; ++i) {
            const double value = values[8 * i];
            if (value > f + apart) continue;
            if (value < f - apart) cell.list.resize(1);
            cell.list.push_back(from[i + 1]);
            if (seam > 0) {
                const double h = std::max(seam - std::abs(f - value), 0.0);
                f = std::min(f, value) - h * h / (4 * seam);
            }
        }
        cell.list[0] = int32_t(cell.list.size() - 1);
    }

    static inline std::atomic<uint64_t> made_{0};

    Elements elements_;
    uint64_t number_ = ++made_;  // another one for each of the process
    Cell root_;
    mutable std::deque<std::array<Cell, 8>> cells_;
    mutable std::atomic<size_t> divided_{0};
    mutable std::mutex store_;
    mutable std::array<std::mutex, 64> locks_;
};

// What `fracslice.expr.emitter` calls, by its place in memory: with this, and the rows of as many lanes.
struct Near {
    const int32_t* (*floats)(const Near*, const float*, size_t);
    const int32_t* (*doubles)(const Near*, const double*, size_t);
    const int32_t* (*boxes_of_floats)(const Near*, const float*, size_t);
    const int32_t* (*boxes_of_doubles)(const Near*, const double*, size_t);
    const Regions* regions;
};

template <class Real>
const int32_t* near_points(const Near* near, const Real* rows, size_t count) {
    return near->regions->at_points(rows, count);
}

template <class Real>
const int32_t* near_brick(const Near* near, const Real* rows, size_t count) {
    return near->regions->in_brick(rows, count);
}

template <class Real>
const int32_t* near_boxes(const Near* near, const Real* rows, size_t count) {
    return near->regions->in_boxes(rows, count);
}

inline Near near_points_of(const Regions& regions) {
    return {&near_points<float>, &near_points<double>, &near_boxes<float>, &near_boxes<double>, &regions};
}

inline Near near_bricks_of(const Regions& regions) {
    return {&near_brick<float>, &near_brick<double>, &near_boxes<float>, &near_boxes<double>, &regions};
}

}  // namespace fracslice::volume
