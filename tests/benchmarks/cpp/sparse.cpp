// Sparse sampling and sparse marching cubes with welded vertices, closed and manifold:
// `sparse WORK N OUT.bin [--runs 5] [--threads T] [--track 1]`.
//
// An octree of leaves of 8^3 cells drops what the estimate proves empty; a leaf samples 9^3 cell centres, its own and
// those that its cells share with the next. With --track a leaf is evaluated only when it is reached from the outside
// through outside samples: an inside is never sampled beyond its first layer, and closed cavities are lost.
#include <omp.h>

#include <cstring>

#include "geometry.h"
#include "marching_cubes.h"
#include "program.h"

using namespace peers;

namespace {

constexpr int SIDE = 9, SAMPLES = SIDE * SIDE * SIDE, BLOCK = 32;
constexpr int PADDED = (SAMPLES + Floats::count - 1) / Floats::count * Floats::count;

// What is kept of a leaf with a surface: where its vertices are numbered from, which edges are crossed, and signs.
struct Leaf {
    int x, y, z;
    std::uint32_t base;
    std::uint64_t crossed[3][8];   // by axis and x; bit 8 y + z
    std::uint16_t before[3][8];    // vertices of the leaf before them
    std::uint16_t inside[SIDE * SIDE];  // by 9 x + y; bit z
};

struct Arena {
    std::vector<Leaf> leaves;
    std::vector<float> points;
    std::size_t evaluations = 0;
};

struct Offsets {
    alignas(64) float x[PADDED], y[PADDED], z[PADDED];
    Offsets() {
        for (int i = 0; i < PADDED; ++i) {
            const int s = std::min(i, SAMPLES - 1);
            x[i] = float(s / 81);
            y[i] = float(s / 9 % 9);
            z[i] = float(s % 9);
        }
    }
};
const Offsets offsets;

// Evaluates a leaf's samples; bit i of `signs`: sample i is inside.
void evaluate(const Grid& grid, int x0, int y0, int z0, float* values, std::uint32_t* signs) {
    const Floats x(x0 + 0.5f), y(y0 + 0.5f), z(z0 + 0.5f), h(grid.h), lo(grid.lo), iso(grid.iso), zero(0.0f);
    for (int i = 0; i < PADDED; i += Floats::count) {
        const Floats f = estimate(grid.work.shape, multiply_add(Floats::load(offsets.x + i) + x, h, lo),
                                  multiply_add(Floats::load(offsets.y + i) + y, h, lo),
                                  multiply_add(Floats::load(offsets.z + i) + z, h, lo)) - iso;
        f.store(values + i);
        for (int k = 0; k < Floats::count; ++k) {
            const int s = i + k;
            if (k == 0 && Floats::count == 32) {
                signs[s / 32] = std::uint32_t(greater(zero, f));
                break;
            }
            if (s % 32 == 0) signs[s / 32] = 0;
            signs[s / 32] |= std::uint32_t(greater(zero, f) >> k & 1) << s % 32;
        }
    }
}

// Puts a vertex on each crossed edge that starts in the leaf, by linear interpolation.
void place_vertices(const Grid& grid, const float* values, Leaf& leaf, std::vector<float>& points) {
    constexpr int strides[3] = {81, 9, 1};
    std::uint16_t count = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < 8; ++i) {
            leaf.before[axis][i] = count;
            std::uint64_t word = 0;
            for (int j = 0; j < 8; ++j) {
                const int row = i * 9 + j;
                const std::uint32_t here = leaf.inside[row];
                const std::uint32_t next = axis == 0 ? leaf.inside[row + 9] : axis == 1 ? leaf.inside[row + 1] : here >> 1;
                word |= std::uint64_t((here ^ next) & 0xff) << 8 * j;
            }
            leaf.crossed[axis][i] = word;
            count += std::uint16_t(__builtin_popcountll(word));
            for (; word; word &= word - 1) {
                const int bit = __builtin_ctzll(word), j = bit >> 3, k = bit & 7, s = i * 81 + j * 9 + k;
                float at[3] = {leaf.x + i + 0.5f, leaf.y + j + 0.5f, leaf.z + k + 0.5f};
                at[axis] += values[s] / (values[s] - values[s + strides[axis]]);
                for (const float v : at) points.push_back(grid.lo + v * grid.h);
            }
        }
}

// Samples a leaf and keeps it if there is a surface in it; returns the faces (x-, x+, y-, ...) with an outside sample.
int sample_leaf(const Grid& grid, int x, int y, int z, Arena& arena) {
    alignas(64) float values[PADDED];
    std::uint32_t signs[PADDED / 32 + 2] = {}, any = 0, all = ~0u;
    evaluate(grid, x, y, z, values, signs);
    arena.evaluations += SAMPLES;
    for (int i = 0; i < PADDED / 32; ++i) {
        any |= signs[i];
        all &= signs[i];
    }
    if (!any) return 63;
    if (all == ~0u) return 0;
    arena.leaves.emplace_back();
    Leaf& leaf = arena.leaves.back();
    leaf.x = x;
    leaf.y = y;
    leaf.z = z;
    leaf.base = std::uint32_t(arena.points.size() / 3);
    for (int row = 0; row < SIDE * SIDE; ++row) {
        const int bit = row * SIDE;
        const std::uint64_t word = signs[bit / 32] | std::uint64_t(signs[bit / 32 + 1]) << 32;
        leaf.inside[row] = std::uint16_t(word >> bit % 32 & 0x1ff);
    }
    place_vertices(grid, values, leaf, arena.points);
    int faces = 0;
    for (int r = 0; r < SIDE; ++r) {
        faces |= (leaf.inside[r] != 0x1ff) | (leaf.inside[72 + r] != 0x1ff) << 1;
        faces |= (leaf.inside[9 * r] != 0x1ff) << 2 | (leaf.inside[9 * r + 8] != 0x1ff) << 3;
    }
    for (const std::uint16_t row : leaf.inside) faces |= !(row & 1) << 4 | !(row >> 8 & 1) << 5;
    return faces;
}

// Everything that may hold a surface, top down.
void descend(const Grid& grid, int x, int y, int z, int s, Arena& arena) {
    ++arena.evaluations;
    if (grid.classify(x, y, z, s) != 0) return;
    if (s == 8) {
        sample_leaf(grid, x, y, z, arena);
        return;
    }
    const int t = s / 2;
    for (int q = 0; q < 8; ++q) descend(grid, x + (q >> 2) * t, y + (q >> 1 & 1) * t, z + (q & 1) * t, t, arena);
}

// From the outside inwards, leaf by leaf.
class Tracker {
public:
    Tracker(const Grid& of, int threads)
        : grid(of), side(of.n / 8), state(std::size_t(side) * side * side, EMPTY), next(threads) {}

    void run(std::vector<Arena>& arenas) {
        const int blocks = (grid.n + BLOCK - 1) / BLOCK;
#pragma omp parallel for schedule(dynamic, 1)
        for (int q = 0; q < blocks * blocks * blocks; ++q)
            mark(q / (blocks * blocks) * BLOCK, q / blocks % blocks * BLOCK, q % blocks * BLOCK, BLOCK,
                 arenas[omp_get_thread_num()].evaluations);
        std::vector<std::size_t> front = first();
        for (const std::size_t at : front) state[at] = DONE;
        while (!front.empty()) {
#pragma omp parallel for schedule(dynamic, 8)
            for (std::size_t i = 0; i < front.size(); ++i) visit(front[i], arenas[omp_get_thread_num()]);
            front.clear();
            for (auto& found : next) {
                front.insert(front.end(), found.begin(), found.end());
                found.clear();
            }
        }
    }

private:
    enum : std::uint8_t { EMPTY, CANDIDATE, FULL, DONE };
    static constexpr int step[6][3] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
    Grid grid;
    int side;
    std::vector<std::uint8_t> state;
    std::vector<std::vector<std::size_t>> next;

    std::size_t at(int x, int y, int z) const { return (std::size_t(x) * side + y) * side + z; }
    bool within(int x, int y, int z) const {
        return x >= 0 && y >= 0 && z >= 0 && x < side && y < side && z < side;
    }

    void mark(int x, int y, int z, int s, std::size_t& evaluations) {
        ++evaluations;
        const int kind = grid.classify(x, y, z, s);
        if (kind > 0) return;
        if (s == 8 || kind < 0) {
            for (int a = 0; a < s; a += 8)
                for (int b = 0; b < s; b += 8)
                    for (int c = 0; c < s; c += 8)
                        if (within((x + a) / 8, (y + b) / 8, (z + c) / 8))
                            state[at((x + a) / 8, (y + b) / 8, (z + c) / 8)] = kind < 0 ? FULL : CANDIDATE;
            return;
        }
        const int t = s / 2;
        for (int q = 0; q < 8; ++q) mark(x + (q >> 2) * t, y + (q >> 1 & 1) * t, z + (q & 1) * t, t, evaluations);
    }

    std::vector<std::size_t> first() const {
        std::vector<std::size_t> front;
        for (int x = 0; x < side; ++x)
            for (int y = 0; y < side; ++y)
                for (int z = 0; z < side; ++z) {
                    const auto open = [&](const int* d) {
                        const int a = x + d[0], b = y + d[1], c = z + d[2];
                        return !within(a, b, c) || state[at(a, b, c)] == EMPTY;
                    };
                    if (state[at(x, y, z)] == CANDIDATE && std::any_of(step, step + 6, open)) front.push_back(at(x, y, z));
                }
        return front;
    }

    void visit(std::size_t index, Arena& arena) {
        const int z = int(index % side), y = int(index / side % side), x = int(index / (std::size_t(side) * side));
        const int faces = sample_leaf(grid, 8 * x, 8 * y, 8 * z, arena);
        for (int f = 0; f < 6; ++f) {
            const int a = x + step[f][0], b = y + step[f][1], c = z + step[f][2];
            if (!(faces >> f & 1) || !within(a, b, c)) continue;
            std::uint8_t expected = CANDIDATE;
            if (__atomic_compare_exchange_n(&state[at(a, b, c)], &expected, std::uint8_t(DONE), false,
                                            __ATOMIC_RELAXED, __ATOMIC_RELAXED))
                next[omp_get_thread_num()].push_back(at(a, b, c));
        }
    }
};

struct Surface {
    std::vector<float> points;
    std::vector<std::uint32_t> triangles;
    std::size_t evaluations = 0, leaves = 0;
};

// All leaves in one list, by place, their vertices numbered through.
struct Welded {
    int side;
    std::vector<Leaf*> leaves;
    std::vector<std::int32_t> index;

    Welded(const Grid& grid, std::vector<Arena>& arenas, Surface& surface)
        : side(grid.n / 8 + 1), index(std::size_t(side) * side * side, -1) {
        std::size_t count = 0;
        for (Arena& arena : arenas) {
            for (Leaf& leaf : arena.leaves) {
                leaf.base += std::uint32_t(count);
                index[place(leaf)] = std::int32_t(leaves.size());
                leaves.push_back(&leaf);
            }
            count += arena.points.size() / 3;
            surface.evaluations += arena.evaluations;
        }
        surface.points.reserve(3 * count);
        for (const Arena& arena : arenas)
            surface.points.insert(surface.points.end(), arena.points.begin(), arena.points.end());
        surface.leaves = leaves.size();
    }

    std::size_t place(const Leaf& leaf) const {
        return (std::size_t(leaf.x / 8) * side + leaf.y / 8) * side + leaf.z / 8;
    }

    // The leaf itself and those after it along the axes: bit 0 x, 1 y, 2 z.
    std::array<const Leaf*, 8> around(const Leaf& leaf) const {
        std::array<const Leaf*, 8> found;
        for (int q = 0; q < 8; ++q) {
            const std::size_t at = place(leaf) + (q & 1 ? std::size_t(side) * side : 0) + (q >> 1 & 1 ? side : 0) + (q >> 2 & 1);
            found[q] = index[at] < 0 ? nullptr : leaves[index[at]];
        }
        return found;
    }
};

// The triangles of one leaf's cells.
void triangulate(const Cases& cases, const Welded& all, const Leaf& leaf, std::vector<std::uint32_t>& out) {
    const auto around = all.around(leaf);
    const auto vertex = [&](int edge, int i, int j, int k) {
        const int axis = edge >> 2, first = edge & 1, second = edge >> 1 & 1;
        const int x = i + (axis == 0 ? 0 : first), y = j + (axis == 1 ? 0 : axis == 0 ? first : second);
        const int z = k + (axis == 2 ? 0 : second);
        const Leaf& owner = *around[x >> 3 | (y >> 3) << 1 | (z >> 3) << 2];
        const std::uint64_t below = (std::uint64_t(1) << ((y & 7) * 8 + (z & 7))) - 1;
        return owner.base + owner.before[axis][x & 7] +
               std::uint32_t(__builtin_popcountll(owner.crossed[axis][x & 7] & below));
    };
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) {
            const std::uint32_t rows[4] = {leaf.inside[i * 9 + j], leaf.inside[i * 9 + 9 + j],
                                           leaf.inside[i * 9 + j + 1], leaf.inside[i * 9 + 10 + j]};
            const std::uint32_t any = rows[0] | rows[1] | rows[2] | rows[3];
            const std::uint32_t all_in = rows[0] & rows[1] & rows[2] & rows[3];
            for (std::uint32_t mixed = (any | any >> 1) & ~(all_in & all_in >> 1) & 0xff; mixed; mixed &= mixed - 1) {
                const int k = __builtin_ctz(mixed);
                int mask = 0;
                for (int corner = 0; corner < 8; ++corner) mask |= int(rows[corner & 3] >> (k + (corner >> 2)) & 1) << corner;
                for (const std::uint8_t edge : cases.edges[mask]) out.push_back(vertex(edge, i, j, k));
            }
        }
}

Surface mesh(const Grid& grid, const Cases& cases, int threads, bool track, double& sampled) {
    std::vector<Arena> arenas(threads);
    const double start = wall();
    if (track) {
        Tracker(grid, threads).run(arenas);
    } else {
        const int blocks = (grid.n + BLOCK - 1) / BLOCK;
#pragma omp parallel for schedule(dynamic, 1)
        for (int q = 0; q < blocks * blocks * blocks; ++q)
            descend(grid, q / (blocks * blocks) * BLOCK, q / blocks % blocks * BLOCK, q % blocks * BLOCK, BLOCK,
                    arenas[omp_get_thread_num()]);
    }
    Surface surface;
    const Welded all(grid, arenas, surface);
    sampled = wall() - start;
    std::vector<std::vector<std::uint32_t>> made(threads);
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < all.leaves.size(); ++i) triangulate(cases, all, *all.leaves[i], made[omp_get_thread_num()]);
    std::vector<std::size_t> ends(threads + 1, 0);
    for (int t = 0; t < threads; ++t) ends[t + 1] = ends[t] + made[t].size();
    surface.triangles.resize(ends[threads]);
#pragma omp parallel for schedule(static)
    for (int t = 0; t < threads; ++t) std::copy(made[t].begin(), made[t].end(), surface.triangles.begin() + ends[t]);
    return surface;
}

}  // namespace

int main(int count, char** given) {
    return run(count, given, "WORK N OUT.bin [--runs 5] [--threads T] [--track 1]", [](const Options& options) {
        const Grid grid(workload(options.word(0, "a workload")), std::stoi(options.word(1, "a resolution")));
        if (grid.n % 8 != 0) throw std::invalid_argument("N: expected a multiple of 8");
        const int threads = options.threads();
        omp_set_num_threads(threads);
        const Cases cases;
        Surface surface;
        Runs runs;
        std::vector<double> sampling;
        for (int r = 0; r < options.whole("runs", 5); ++r) {
            surface = {};
            sampling.push_back(0);
            runs.time([&] { surface = mesh(grid, cases, threads, options.whole("track", 0), sampling.back()); });
        }
        write_mesh(options.word(2, "an output file"), surface.points.data(), surface.points.size() / 3, surface.triangles);
        runs.line().add("sampling_s", median(sampling)).add("evals", double(surface.evaluations))
            .add("leaves", double(surface.leaves)).add("worker_peak_mb", peak_mb()).print();
    });
}
