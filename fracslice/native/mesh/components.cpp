#include "components.h"

#include <tbb/enumerable_thread_specific.h>

#include <cassert>
#include <cmath>
#include <utility>

#include "../disjoint_sets.h"
#include "blocks.h"
#include "vec3.h"

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

}  // namespace fracslice::mesh
