// All rays go the same way, so that the triangles are gone through once: each is held against the rays below it.
#include "nesting.h"

#include <array>
#include <cassert>
#include <cmath>

#include "blocks.h"
#include "predicates.h"

namespace fracslice::mesh {
namespace {

// 1 if the ray up from p leaves through the triangle, -1 if it enters, else 0.
int winding_of(const MeshView& mesh, size_t t, const double* p) {
    int turn = 0;
    for (int k = 0; k < 3; ++k) {
        const double *a = mesh.corner(t, k), *b = mesh.corner(t, (k + 1) % 3);
        bool up = a[1] <= p[1] && p[1] < b[1], down = b[1] <= p[1] && p[1] < a[1];
        if (!up && !down) continue;
        int side = side_of_line(a[0], a[1], b[0], b[1], p[0], p[1]);
        turn += (up && side > 0) - (down && side < 0);
    }
    if (turn == 0) return 0;
    return side_of_plane(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), p) * turn > 0 ? turn : 0;
}

// The start of a shell's ray.
struct Start {
    double at[3];
    size_t shell;
};

// The starts, by cells of a grid across the rays.
class Starts {
  public:
    Starts(const MeshView& mesh, std::span<const int64_t> first) {
        for (size_t shell = 0; shell < first.size(); ++shell) {
            if (first[shell] < 0) continue;
            const double* p = mesh.point(int32_t(first[shell]));
            starts_.push_back({{p[0], p[1], p[2]}, shell});
            for (size_t k = 0; k < 2; ++k) low_[k] = std::min(low_[k], p[k]), high_[k] = std::max(high_[k], p[k]);
        }
        side_ = std::clamp(int(kFine * std::sqrt(double(starts_.size()))), 1, kMostCells);
        for (size_t k = 0; k < 2; ++k) scale_[k] = high_[k] > low_[k] ? side_ / (high_[k] - low_[k]) : 0;
        auto cell_of = [&](const Start& start) { return cell(place(start.at[0], 0), place(start.at[1], 1)); };
        std::sort(starts_.begin(), starts_.end(), [&](const Start& a, const Start& b) { return cell_of(a) < cell_of(b); });
        cells_.resize(size_t(side_) * size_t(side_) + 1, 0);
        for (const Start& start : starts_) ++cells_[cell_of(start) + 1];
        for (size_t i = 1; i < cells_.size(); ++i) cells_[i] += cells_[i - 1];
    }

    // Calls act(start) for the rays that may pass a box: those that start in its cells below its top.
    template <class Do>
    void for_each_in(const double* low, const double* high, const Do& act) const {
        if (low[0] > high_[0] || low[1] > high_[1] || high[0] < low_[0] || high[1] < low_[1]) return;
        int y0 = place(low[1], 1), y1 = place(high[1], 1);
        for (int x = place(low[0], 0), last = place(high[0], 0); x <= last; ++x) {
            for (size_t i = cells_[cell(x, y0)], end = cells_[cell(x, y1) + 1]; i < end; ++i) {
                const double* p = starts_[i].at;
                if (low[0] <= p[0] && p[0] <= high[0] && low[1] <= p[1] && p[1] <= high[1] && p[2] <= high[2]) act(starts_[i]);
            }
        }
    }

  private:
    static constexpr int kFine = 4, kMostCells = 1024;  // cells per start, its root; along a side

    // Of the cell along an axis: the same or a higher one for a greater coordinate.
    int place(double x, size_t k) const { return int(std::clamp((x - low_[k]) * scale_[k], 0.0, side_ - 1.0)); }
    size_t cell(int x, int y) const { return size_t(x) * size_t(side_) + size_t(y); }

    std::array<double, 2> low_{HUGE_VAL, HUGE_VAL}, high_{-HUGE_VAL, -HUGE_VAL}, scale_{};
    int side_ = 1;
    std::vector<Start> starts_;
    std::vector<size_t> cells_;  // the first start of each, and behind the last
};

// A triangle that a shell's ray passes.
struct Hit {
    size_t shell;
    int32_t other;
    int winding;
};

std::vector<Hit> hits(const MeshView& mesh, std::span<const int32_t> labels, const Starts& starts) {
    return joined(in_blocks<std::vector<Hit>>(mesh.count, [&](size_t begin, size_t end) {
        std::vector<Hit> found;
        for (size_t t = begin; t < end; ++t) {
            const double *a = mesh.corner(t, 0), *b = mesh.corner(t, 1), *c = mesh.corner(t, 2);
            double low[2], high[3];
            for (int k = 0; k < 2; ++k) low[k] = std::min({a[k], b[k], c[k]});
            for (int k = 0; k < 3; ++k) high[k] = std::max({a[k], b[k], c[k]});
            starts.for_each_in(low, high, [&](const Start& start) {
                int winding = size_t(labels[t]) == start.shell ? 0 : winding_of(mesh, t, start.at);
                if (winding != 0) found.push_back({start.shell, labels[t], winding});
            });
        }
        return found;
    }));
}

}  // namespace

Nesting nesting(const MeshView& mesh, std::span<const int32_t> labels, std::span<const double> sizes,
                std::span<const int64_t> first) {
    assert(labels.size() == mesh.count && sizes.size() == first.size());
    Nesting nested{{first.size(), 1}, {first.size(), 1}};
    int64_t *winding = nested.winding.data.get(), *parent = nested.parent.data.get();
    std::fill_n(winding, first.size(), 0), std::fill_n(parent, first.size(), -1);
    std::vector<Hit> found = hits(mesh, labels, Starts(mesh, first));
    auto before = [](const Hit& a, const Hit& b) { return a.shell != b.shell ? a.shell < b.shell : a.other < b.other; };
    std::sort(found.begin(), found.end(), before);
    for (size_t i = 0, j; i < found.size(); i = j) {  // one shell and one other after the other
        int64_t around = 0;
        for (j = i; j < found.size() && !before(found[i], found[j]); ++j) around += found[j].winding;
        if (around == 0) continue;
        size_t shell = found[i].shell;
        winding[shell] += around;
        if (parent[shell] < 0 || sizes[size_t(found[i].other)] < sizes[size_t(parent[shell])]) parent[shell] = found[i].other;
    }
    return nested;
}

}  // namespace fracslice::mesh
