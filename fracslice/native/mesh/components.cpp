#include "components.h"

#include <cassert>
#include <cmath>
#include <limits>

#include "blocks.h"
#include "vec3.h"

namespace fracslice::mesh {
namespace {

constexpr int32_t kNever = std::numeric_limits<int32_t>::max();

using Atomics = std::vector<std::atomic<int32_t>>;

int32_t get(const std::atomic<int32_t>& number) { return number.load(std::memory_order_relaxed); }

// Sets that any number of threads unite. A root is the lowest of its set, and a parent is lower than its children: whoever loses
// a race looks again (Anderson and Woll, "Wait-free Parallel Algorithms for the Union-Find Problem", 1991).
class Forest {
  public:
    explicit Forest(size_t count) : parent_(count) {
        for_each_block(count, [&](size_t, size_t first, size_t last) {
            for (size_t v = first; v < last; ++v) parent_[v].store(int32_t(v), std::memory_order_relaxed);
        });
    }

    // Halves the path (Tarjan and van Leeuwen, 1984): what another thread has put there is an ancestor, too.
    int32_t root(int32_t v) {
        for (int32_t up; (up = get(parent_[v])) != v; v = up) {
            int32_t above = get(parent_[up]);
            assert(up < v && above <= up);
            if (above != up) parent_[v].store(above, std::memory_order_relaxed);
        }
        return v;
    }

    void unite(int32_t a, int32_t b) {
        while ((a = root(a)) != (b = root(b))) {
            int32_t &high = a > b ? a : b, low = std::min(a, b), expected = high;
            if (parent_[high].compare_exchange_strong(expected, low, std::memory_order_relaxed)) return;
        }
    }

  private:
    Atomics parent_;
};

Atomics never(size_t count) {
    Atomics numbers(count);
    for_each_block(count, [&](size_t, size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) numbers[i].store(kNever, std::memory_order_relaxed);
    });
    return numbers;
}

Vec3 at(const double* p) { return {p[0], p[1], p[2]}; }

// Of consecutive triangles of a component.
struct Run {
    int32_t label;
    double volume, area;
};

}  // namespace

Components connected_components(const Triangles& triangles) {
    Forest forest(triangles.vertices);
    for_each_block(triangles.count, [&](size_t, size_t first, size_t last) {
        for (size_t t = first; t < last; ++t) {
            forest.unite(triangles[t][0], triangles[t][1]);
            forest.unite(triangles[t][0], triangles[t][2]);
        }
    });
    Components found{{triangles.count, 1}};
    Atomics number = never(triangles.vertices);  // of a root: its first triangle, then its component
    for_each_block(triangles.count, [&](size_t, size_t first, size_t last) {
        for (size_t t = first; t < last; ++t) {
            int32_t root = found.labels.data[t] = forest.root(triangles[t][0]);
            lower(number[root], int32_t(t));
        }
    });
    std::vector<int64_t> roots = chosen(triangles.vertices, [&](size_t v) { return get(number[v]) != kNever; });
    std::sort(roots.begin(), roots.end(), [&](int64_t a, int64_t b) { return get(number[a]) < get(number[b]); });
    for (int64_t root : roots) number[root].store(found.count++, std::memory_order_relaxed);
    for_each_block(triangles.count, [&](size_t, size_t first, size_t last) {
        for (size_t t = first; t < last; ++t) found.labels.data[t] = get(number[found.labels.data[t]]);
    });
    return found;
}

Sizes component_sizes(const MeshView& mesh, std::span<const int32_t> labels, size_t count) {
    assert(labels.size() == mesh.count);
    Atomics origin = never(count);  // the first triangle
    for_each_block(mesh.count, [&](size_t, size_t first, size_t last) {
        for (size_t t = first; t < last; ++t) {
            if (t == first || labels[t] != labels[t - 1]) lower(origin[labels[t]], int32_t(t));
        }
    });
    auto parts = in_blocks<std::vector<Run>>(mesh.count, [&](size_t first, size_t last) {
        std::vector<Run> runs;
        Vec3 o{};
        for (size_t t = first; t < last; ++t) {
            if (t == first || labels[t] != labels[t - 1]) {
                runs.push_back({labels[t], 0, 0});
                o = at(mesh.corner(size_t(get(origin[labels[t]])), 0));
            }
            Vec3 a = at(mesh.corner(t, 0)), b = at(mesh.corner(t, 1)), c = at(mesh.corner(t, 2));
            Vec3 normal = cross(b - a, c - a);
            runs.back().volume += dot(cross(a - o, b - o), c - o);
            runs.back().area += std::sqrt(dot(normal, normal));
        }
        return runs;
    });
    Sizes sizes{{count, 1}, {count, 1}};
    double *volumes = sizes.volumes.data.get(), *areas = sizes.areas.data.get();
    std::fill_n(volumes, count, 0.0), std::fill_n(areas, count, 0.0);
    for (const std::vector<Run>& runs : parts) {
        for (const Run& run : runs) volumes[run.label] += run.volume, areas[run.label] += run.area;
    }
    for (size_t k = 0; k < count; ++k) volumes[k] /= 6, areas[k] /= 2;
    return sizes;
}

}  // namespace fracslice::mesh
