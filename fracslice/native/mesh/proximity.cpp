#include "proximity.h"

#include <array>
#include <stdexcept>

#include "blocks.h"

namespace fracslice::mesh {
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
