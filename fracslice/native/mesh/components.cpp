// All rays go the same way, so that the triangles are gone through once: each is held against the rays below it.
#include "components.h"

#include <array>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <tbb/enumerable_thread_specific.h>
#include <utility>

#include "../disjoint_sets.h"
#include "triangles.h"
#include "predicates.h"

namespace fracslice::mesh {
namespace {

Vec3 at(const double* p) { return {p[0], p[1], p[2]}; }

// Of the triangles of a component in a block.
struct Sum {
    int32_t label;
    double volume = 0, area = 0;
    Vec3 vector{0, 0, 0};
    int64_t flat = 0;
};

// Of the vertices of a component in a block: those farthest out.
struct Reach {
    int32_t label;
    std::array<int32_t, 6> vertex{-1, -1, -1, -1, -1, -1};
    Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

    void add(size_t k, double low_here, int32_t low_vertex, double high_here, int32_t high_vertex) {
        if (low_here < low[k]) low[k] = low_here, vertex[k] = low_vertex;
        if (high_here > high[k]) high[k] = high_here, vertex[k + 3] = high_vertex;
    }
};

// The parts of one block after another, one for each of its components.
template <class Part>
class ByComponent {
  public:
    explicit ByComponent(size_t count) : place_(count, kNone) {}

    Part& of(int32_t label) {
        size_t& place = place_[size_t(label)];
        if (place == kNone) {
            place = parts_.size();
            parts_.push_back({label});
        }
        return parts_[place];
    }

    std::vector<Part> taken() {
        for (const Part& part : parts_) place_[size_t(part.label)] = kNone;
        return std::exchange(parts_, {});
    }

  private:
    static constexpr size_t kNone = size_t(-1);
    std::vector<size_t> place_;
    std::vector<Part> parts_;
};

// The parts of all blocks of `size` things; add(parts, first, last) adds a block's.
template <class Part, class Do>
std::vector<std::vector<Part>> by_component(size_t size, size_t count, const Do& add) {
    tbb::enumerable_thread_specific<ByComponent<Part>> parts(count);
    return in_blocks<std::vector<Part>>(size, [&](size_t first, size_t last) {
        add(parts.local(), first, last);
        return parts.local().taken();
    });
}

std::vector<Reach> reaches(const MeshView& mesh, std::span<const int32_t> labels, size_t count) {
    std::vector<Reach> all(count);
    auto add = [&](ByComponent<Reach>& parts, size_t first, size_t last) {
        for (size_t v = first; v < last; ++v) {
            if (labels[v] < 0) continue;
            Reach& reach = parts.of(labels[v]);
            const double* p = mesh.point(int32_t(v));
            for (size_t k = 0; k < 3; ++k) reach.add(k, p[k], int32_t(v), p[k], int32_t(v));
        }
    };
    for (const auto& block : by_component<Reach>(mesh.vertices, count, add)) {
        for (const Reach& part : block) {
            Reach& to = all[size_t(part.label)];
            for (size_t k = 0; k < 3; ++k) to.add(k, part.low[k], part.vertex[k], part.high[k], part.vertex[k + 3]);
        }
    }
    return all;
}

}  // namespace

Components connected_components(const Triangles& triangles) {
    Array<int32_t> parent(triangles.vertices, 1);
    for_each_number(triangles.vertices, [&](size_t v) { parent.data[v] = int32_t(v); });
    const DisjointSets<int32_t, true> forest({parent.data.get(), triangles.vertices});
    for_each_number(triangles.count, [&](size_t t) {
        forest.unite(triangles[t][0], triangles[t][1]);
        forest.unite(triangles[t][0], triangles[t][2]);
    });
    std::vector<std::atomic<bool>> used(triangles.vertices);  // roots
    for_each_number(triangles.count, [&](size_t t) {
        std::atomic<bool>& mark = used[size_t(forest.root(triangles[t][0]))];
        if (!mark.load(std::memory_order_relaxed)) mark.store(true, std::memory_order_relaxed);
    });
    auto is_root = [&](size_t v) { return used[v].load(std::memory_order_relaxed); };
    std::vector<size_t> before = counted(triangles.vertices, is_root);
    Components result{{triangles.vertices, 1}, int32_t(before.back())};
    int32_t* labels = result.labels.data.get();
    for_each_block(triangles.vertices, [&](size_t block, size_t first, size_t last) {
        for (size_t v = first, next = before[block]; v < last; ++v) labels[v] = is_root(v) ? int32_t(next++) : -1;
    });
    for_each_number(triangles.vertices, [&](size_t v) {
        if (!is_root(v)) labels[v] = labels[forest.root(int32_t(v))];
    });
    return result;
}

Sizes component_sizes(const MeshView& mesh, std::span<const int32_t> labels, size_t count) {
    assert(labels.size() == mesh.vertices);
    std::vector<Reach> reach = reaches(mesh, labels, count);
    auto add = [&](ByComponent<Sum>& parts, size_t first, size_t last) {
        for (size_t t = first; t < last; ++t) {
            Sum& sum = parts.of(labels[size_t(mesh[t][0])]);
            Vec3 a = at(mesh.corner(t, 0)), b = at(mesh.corner(t, 1)), c = at(mesh.corner(t, 2));
            Vec3 normal = cross(b - a, c - a);
            sum.volume += dot(normal, a - at(mesh.point(reach[size_t(sum.label)].vertex[0])));
            double size = std::sqrt(dot(normal, normal));
            sum.area += size;
            sum.flat += size == 0;
            sum.vector = sum.vector + normal;
        }
    };
    std::vector<Sum> sums(count);
    for (const auto& block : by_component<Sum>(mesh.count, count, add)) {
        for (const Sum& part : block) {
            Sum& sum = sums[size_t(part.label)];
            sum.volume += part.volume, sum.area += part.area, sum.vector = sum.vector + part.vector;
            sum.flat += part.flat;
        }
    }
    Sizes sizes{{count, 1}, {count, 1}, {count, 3}, {count, 6}, {count, 1}};
    for (size_t i = 0; i < count; ++i) {
        sizes.volumes.data[i] = sums[i].volume / 6, sizes.areas.data[i] = sums[i].area / 2, sizes.flat.data[i] = sums[i].flat;
        for (size_t k = 0; k < 3; ++k) sizes.vectors.data[3 * i + k] = sums[i].vector[k] / 2;
        std::copy(reach[i].vertex.begin(), reach[i].vertex.end(), &sizes.outermost.data[6 * i]);
    }
    return sizes;
}

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

namespace {

// Slots of an almost empty table: most points of the largest body then look at a single one.
constexpr size_t kLeast = size_t(1) << 16;

// Cube of a point beyond the origin in a lattice, as one number: 21 bits of each index.
struct Lattice {
    Vec3 origin;
    double scale;

    uint64_t operator()(const double* p) const {
        uint64_t cube = 0;
        for (size_t k = 0; k < 3; ++k) cube = cube << 21 | (uint64_t(int64_t((p[k] - origin[k]) * scale)) & 0x1FFFFF);
        return cube;
    }
};

size_t mixed(uint64_t cube) {
    cube = (cube ^ (cube >> 31)) * 0x9E3779B97F4A7C15u;
    return cube ^ (cube >> 32);
}

// The first point that came to each cube. Which one that is depends on the threads.
class FirstPoints {
  public:
    FirstPoints(const double* points, const Lattice& lattice, size_t most) : points_(points), lattice_(lattice), slots_(slots(most)) {
        for_each_number(slots_.size(), [&](size_t i) { slots_[i].store(-1, std::memory_order_relaxed); });
    }

    // The first point of the cube of a point: the point itself if there was none.
    int32_t enter(int32_t point) {
        uint64_t cube = lattice_(points_ + 3 * size_t(point));
        for (size_t slot = mixed(cube);; ++slot) {
            int32_t expected = -1;
            if (at(slot).compare_exchange_strong(expected, point, std::memory_order_relaxed)) return point;
            if (lattice_(points_ + 3 * size_t(expected)) == cube) return expected;
        }
    }

    // The same, but nothing enters: -1 if there was none.
    int32_t find(const double* p) {
        uint64_t cube = lattice_(p);
        for (size_t slot = mixed(cube);; ++slot) {
            int32_t there = at(slot).load(std::memory_order_relaxed);
            if (there < 0 || lattice_(points_ + 3 * size_t(there)) == cube) return there;
        }
    }

  private:
    static size_t slots(size_t most) {
        size_t count = kLeast;
        while (count <= 2 * most) count *= 2;
        return count;
    }

    std::atomic<int32_t>& at(size_t slot) { return slots_[slot & (slots_.size() - 1)]; }

    const double* points_;
    Lattice lattice_;
    std::vector<std::atomic<int32_t>> slots_;
};

}  // namespace

std::vector<int64_t> near_bodies(const LabelledPoints& all, size_t count, int32_t largest, const Cubes& cubes) {
    auto body = [&](size_t v) { return all.bodies[size_t(all.labels[v])]; };
    auto is_small = [&](size_t v) { return body(v) >= 0 && body(v) != largest; };
    std::vector<std::atomic<bool>> near(count);
    auto meet = [&](int32_t a, int32_t b) {
        if (a == b) return;
        for (int32_t one : {a, b}) near[size_t(one)].store(true, std::memory_order_relaxed);
    };
    if (all.labels.size() > INT32_MAX) throw std::invalid_argument("more than 2^31 points");
    size_t small = counted(all.labels.size(), is_small).back();
    auto seen_by = [&](double shift) {
        Vec3 origin = cubes.origin;
        for (double& x : origin) x -= shift * cubes.edge;
        return FirstPoints(all.points, {origin, 1 / cubes.edge}, small);
    };
    std::array<FirstPoints, 2> lattices{seen_by(0), seen_by(0.5)};
    for_each_number(all.labels.size(), [&](size_t v) {
        if (!is_small(v)) return;
        for (FirstPoints& seen : lattices) meet(body(v), body(size_t(seen.enter(int32_t(v)))));
    });
    for_each_number(all.labels.size(), [&](size_t v) {
        if (body(v) != largest) return;
        for (FirstPoints& seen : lattices) {
            if (int32_t other = seen.find(all.points + 3 * v); other >= 0) meet(largest, body(size_t(other)));
        }
    });
    return chosen(count, [&](size_t b) { return near[b].load(std::memory_order_relaxed); });
}

}  // namespace fracslice::mesh
