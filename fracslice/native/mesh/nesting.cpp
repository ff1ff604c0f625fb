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

// The starts of the rays, by cells of a grid across them.
class Starts {
  public:
    Starts(const MeshView& mesh, std::span<const int64_t> first) : mesh_(mesh), first_(first) {
        std::vector<size_t> rays;
        for (size_t shell = 0; shell < first.size(); ++shell) {
            if (first[shell] < 0) continue;
            rays.push_back(shell);
            for (int k = 0; k < 2; ++k) {
                low_[k] = std::min(low_[k], point(shell)[k]);
                high_[k] = std::max(high_[k], point(shell)[k]);
            }
        }
        side_ = std::clamp(int(std::sqrt(double(rays.size()))), 1, kMostCells);
        for (int k = 0; k < 2; ++k) scale_[k] = high_[k] > low_[k] ? side_ / (high_[k] - low_[k]) : 0;
        rays_.resize(size_t(side_) * size_t(side_));
        for (size_t shell : rays) rays_[cell(place(point(shell), 0), place(point(shell), 1))].push_back(shell);
    }

    const double* point(size_t shell) const { return mesh_.point(int32_t(first_[shell])); }

    // Calls act(shell) for the rays that may pass a box: those that start in its cells below its top.
    template <class Do>
    void for_each_in(const double* low, const double* high, const Do& act) const {
        if (low[0] > high_[0] || low[1] > high_[1] || high[0] < low_[0] || high[1] < low_[1]) return;
        int x0 = place(low, 0), x1 = place(high, 0), y0 = place(low, 1), y1 = place(high, 1);
        for (int x = x0; x <= x1; ++x) {
            for (int y = y0; y <= y1; ++y) {
                for (size_t shell : rays_[cell(x, y)]) {
                    const double* p = point(shell);
                    if (low[0] <= p[0] && p[0] <= high[0] && low[1] <= p[1] && p[1] <= high[1] && p[2] <= high[2]) act(shell);
                }
            }
        }
    }

  private:
    static constexpr int kMostCells = 512;

    // Of the cell along an axis: the same or a higher one for a greater coordinate.
    int place(const double* p, int k) const { return int(std::clamp((p[k] - low_[k]) * scale_[k], 0.0, side_ - 1.0)); }
    size_t cell(int x, int y) const { return size_t(x) * size_t(side_) + size_t(y); }

    const MeshView& mesh_;
    std::span<const int64_t> first_;
    std::array<double, 2> low_{HUGE_VAL, HUGE_VAL}, high_{-HUGE_VAL, -HUGE_VAL}, scale_{};
    int side_ = 1;
    std::vector<std::vector<size_t>> rays_;
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
            starts.for_each_in(low, high, [&](size_t shell) {
                int winding = size_t(labels[t]) == shell ? 0 : winding_of(mesh, t, starts.point(shell));
                if (winding != 0) found.push_back({shell, labels[t], winding});
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
