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

// Whether the ray up from p passes the box of a triangle.
bool below(const MeshView& mesh, size_t t, const double* p) {
    const double *a = mesh.corner(t, 0), *b = mesh.corner(t, 1), *c = mesh.corner(t, 2);
    for (int k = 0; k < 2; ++k) {
        if (!(std::min({a[k], b[k], c[k]}) <= p[k] && p[k] <= std::max({a[k], b[k], c[k]}))) return false;
    }
    return p[2] <= std::max({a[2], b[2], c[2]});
}

// The start of a shell's ray.
struct Start {
    double at[3];
    size_t shell;
};

// The starts, by cells of a grid across the rays.
class Starts {
  public:
    Starts(const MeshView& mesh, std::span<const int64_t> first) : mesh_(mesh), of_vertex_(mesh.vertices, 1) {
        for (size_t shell = 0; shell < first.size(); ++shell) {
            if (first[shell] < 0) continue;
            const double* p = mesh.point(int32_t(first[shell]));
            starts_.push_back({{p[0], p[1], p[2]}, shell});
            for (size_t k = 0; k < 2; ++k) low_[k] = std::min(low_[k], p[k]), high_[k] = std::max(high_[k], p[k]);
        }
        if (starts_.empty()) low_.fill(0);
        side_ = std::clamp(size_t(kFine * std::sqrt(double(starts_.size()))), size_t(1), kMostCells);
        for (size_t k = 0; k < 2; ++k) scale_[k] = high_[k] > low_[k] ? double(side_) / (high_[k] - low_[k]) : 0;
        auto before = [&](const Start& a, const Start& b) { return number(cell(a.at)) < number(cell(b.at)); };
        std::sort(starts_.begin(), starts_.end(), before);
        cells_.resize(side_ * side_ + 1, 0);
        for (const Start& start : starts_) ++cells_[number(cell(start.at)) + 1];
        for (size_t i = 1; i < cells_.size(); ++i) cells_[i] += cells_[i - 1];
        for_each_block(mesh.vertices, [&](size_t, size_t begin, size_t end) {
            for (size_t v = begin; v < end; ++v) of_vertex_.data[v] = cell(mesh.point(int32_t(v)));
        });
    }

    // Calls act(start) for the rays that start in the cells of a triangle's box.
    template <class Do>
    void for_each_at(size_t t, const Do& act) const {
        const Cell &a = of_vertex_.data[mesh_[t][0]], &b = of_vertex_.data[mesh_[t][1]], &c = of_vertex_.data[mesh_[t][2]];
        uint16_t x0 = std::min({a[0], b[0], c[0]}), x1 = std::max({a[0], b[0], c[0]});
        uint16_t y0 = std::min({a[1], b[1], c[1]}), y1 = std::max({a[1], b[1], c[1]});
        for (uint16_t x = x0; x <= x1; ++x) {
            for (uint32_t i = cells_[number({x, y0})], end = cells_[number({x, y1}) + 1]; i < end; ++i) act(starts_[i]);
        }
    }

  private:
    static constexpr double kFine = 2;  // cells per start, its root
    static constexpr size_t kMostCells = 1024;
    using Cell = std::array<uint16_t, 2>;

    // The same or a higher one for a greater coordinate.
    uint16_t place(double x, size_t k) const { return uint16_t(std::clamp((x - low_[k]) * scale_[k], 0.0, double(side_ - 1))); }
    Cell cell(const double* p) const { return {place(p[0], 0), place(p[1], 1)}; }
    size_t number(const Cell& cell) const { return cell[0] * side_ + cell[1]; }

    const MeshView& mesh_;
    std::array<double, 2> low_{HUGE_VAL, HUGE_VAL}, high_{-HUGE_VAL, -HUGE_VAL}, scale_{};
    size_t side_ = 1;
    std::vector<Start> starts_;
    std::vector<uint32_t> cells_;  // the first start of each, and behind the last
    Array<Cell> of_vertex_;
};

// A triangle that a shell's ray passes.
struct Hit {
    size_t shell;
    int32_t other;
    int winding;
};

std::vector<Hit> hits(const MeshView& mesh, std::span<const int32_t> labels, const Starts& starts) {
    return joined(in_blocks<std::vector<Hit>>(mesh.count, [&](size_t begin, size_t end) {
        std::vector<Hit> result;
        for (size_t t = begin; t < end; ++t) {
            starts.for_each_at(t, [&](const Start& start) {
                int32_t label = labels[size_t(mesh[t][0])];
                if (size_t(label) == start.shell || !below(mesh, t, start.at)) return;
                int winding = winding_of(mesh, t, start.at);
                if (winding != 0) result.push_back({start.shell, label, winding});
            });
        }
        return result;
    }));
}

}  // namespace

Nesting nesting(const MeshView& mesh, std::span<const int32_t> labels, std::span<const double> sizes,
                std::span<const int64_t> first) {
    assert(labels.size() == mesh.vertices && sizes.size() == first.size());
    Nesting nested{{first.size(), 1}, {first.size(), 1}};
    int64_t *winding = nested.winding.data.get(), *parent = nested.parent.data.get();
    std::fill_n(winding, first.size(), 0), std::fill_n(parent, first.size(), -1);
    std::vector<Hit> result = hits(mesh, labels, Starts(mesh, first));
    auto before = [](const Hit& a, const Hit& b) { return a.shell != b.shell ? a.shell < b.shell : a.other < b.other; };
    std::sort(result.begin(), result.end(), before);
    for (size_t i = 0, j; i < result.size(); i = j) {  // one shell and one other after the other
        int64_t around = 0;
        for (j = i; j < result.size() && !before(result[i], result[j]); ++j) around += result[j].winding;
        if (around == 0) continue;
        size_t shell = result[i].shell;
        winding[shell] += around;
        if (parent[shell] < 0 || sizes[size_t(result[i].other)] < sizes[size_t(parent[shell])]) parent[shell] = result[i].other;
    }
    return nested;
}

}  // namespace fracslice::mesh
