// Sparse sampling into an OpenVDB grid and its own mesher: `vdb WORK N OUT.bin [--runs 5] [--threads T]`.
//
// Leaves near the surface are evaluated; blocks that are proved inside become tiles. Then tools::volumeToMesh.
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <memory>

#include "geometry.h"
#include "program.h"

using namespace peers;

namespace {

using LeafNode = openvdb::FloatTree::LeafNodeType;
constexpr int BLOCK = 32, LEAF = 512;

// Outside values at most this many voxels from the surface are kept: a cell of a neighbour may read them.
constexpr float NEAR = 2, BACKGROUND = 3;

struct Tile {
    openvdb::Coord corner;
    int size;
    float value;
};

struct Part {
    std::vector<std::unique_ptr<LeafNode>> leaves;
    std::vector<Tile> tiles;
    std::size_t evaluations = 0;
};

void evaluate(const Grid& grid, int x0, int y0, int z0, float* values) {
    alignas(64) float y[Floats::count], z[Floats::count];
    for (int lane = 0; lane < Floats::count; ++lane) z[lane] = grid.lo + (z0 + (lane & 7) + 0.5f) * grid.h;
    const Floats zs = Floats::load(z), iso(grid.iso);
    for (int i = 0; i < LEAF; i += Floats::count) {
        for (int lane = 0; lane < Floats::count; ++lane) y[lane] = grid.lo + (y0 + ((i + lane) >> 3 & 7) + 0.5f) * grid.h;
        const Floats x(grid.lo + (x0 + (i >> 6) + 0.5f) * grid.h);
        (estimate(grid.work.shape, x, Floats::load(y), zs) - iso).store(values + i);
    }
}

// A leaf's samples, if there may be a surface beside them.
void sample_leaf(const Grid& grid, int x, int y, int z, Part& part) {
    alignas(64) float values[LEAF];
    evaluate(grid, x, y, z, values);
    part.evaluations += LEAF;
    const auto [low, high] = std::minmax_element(values, values + LEAF);
    const openvdb::Coord corner(x, y, z);
    if (*high < 0) {
        // The field of an escape-time fractal is -iso inside, everywhere but beside the surface.
        const bool far = grid.work.escape_time() ? *high <= -grid.iso : *high < -NEAR * grid.h;
        if (far) {
            part.tiles.push_back({corner, 8, grid.work.escape_time() ? -grid.iso : -BACKGROUND * grid.h});
            return;
        }
    } else if (*low > NEAR * grid.h) {
        return;
    }
    auto leaf = std::make_unique<LeafNode>(corner, 0.0f, true);
    std::copy(values, values + LEAF, leaf->buffer().data());
    part.leaves.push_back(std::move(leaf));
}

void descend(const Grid& grid, int x, int y, int z, int s, Part& part) {
    if (x >= grid.n || y >= grid.n || z >= grid.n) return;
    ++part.evaluations;
    const int kind = grid.classify(x, y, z, s);
    if (kind > 0) return;
    if (kind < 0) {
        part.tiles.push_back({openvdb::Coord(x, y, z), s, -BACKGROUND * grid.h});
        return;
    }
    if (s == 8) {
        sample_leaf(grid, x, y, z, part);
        return;
    }
    const int t = s / 2;
    for (int q = 0; q < 8; ++q) descend(grid, x + (q >> 2) * t, y + (q >> 1 & 1) * t, z + (q & 1) * t, t, part);
}

void add(openvdb::FloatTree& tree, Part& part) {
    for (auto& leaf : part.leaves) tree.addLeaf(leaf.release());
    for (const Tile& tile : part.tiles)
        for (int a = 0; a < tile.size; a += 8)
            for (int b = 0; b < tile.size; b += 8)
                for (int c = 0; c < tile.size; c += 8) tree.addTile(1, tile.corner.offsetBy(a, b, c), tile.value, false);
}

struct Surface {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    std::size_t evaluations = 0, leaves = 0;
};

Surface mesh(const Grid& grid, double& sampled) {
    const double start = wall();
    const int blocks = (grid.n + BLOCK - 1) / BLOCK;
    tbb::enumerable_thread_specific<Part> parts;
    tbb::parallel_for(tbb::blocked_range<int>(0, blocks * blocks * blocks, 1), [&](const tbb::blocked_range<int>& range) {
        for (int q = range.begin(); q < range.end(); ++q)
            descend(grid, q / (blocks * blocks) * BLOCK, q / blocks % blocks * BLOCK, q % blocks * BLOCK, BLOCK, parts.local());
    });
    Surface surface;
    const auto vdb = openvdb::FloatGrid::create(BACKGROUND * grid.h);
    for (Part& part : parts) {
        surface.evaluations += part.evaluations;
        surface.leaves += part.leaves.size();
        add(vdb->tree(), part);
    }
    vdb->setTransform(openvdb::math::Transform::createLinearTransform(grid.h));
    vdb->transform().postTranslate(openvdb::Vec3d(grid.lo + 0.5 * grid.h));
    vdb->setGridClass(openvdb::GRID_LEVEL_SET);
    sampled = wall() - start;
    openvdb::tools::volumeToMesh(*vdb, surface.points, surface.triangles, surface.quads, 0.0, 0.0);
    return surface;
}

// OpenVDB's faces are clockwise seen from outside.
std::vector<std::uint32_t> outward(const Surface& surface) {
    std::vector<std::uint32_t> triangles;
    triangles.reserve(3 * surface.triangles.size() + 6 * surface.quads.size());
    for (const auto& t : surface.triangles) triangles.insert(triangles.end(), {t[0], t[2], t[1]});
    for (const auto& q : surface.quads) triangles.insert(triangles.end(), {q[0], q[2], q[1], q[0], q[3], q[2]});
    return triangles;
}

}  // namespace

int main(int count, char** given) {
    return run(count, given, "WORK N OUT.bin [--runs 5] [--threads T]", [](const Options& options) {
        const Grid grid(workload(options.word(0, "a workload")), std::stoi(options.word(1, "a resolution")));
        const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, options.threads());
        openvdb::initialize();
        Surface surface;
        Runs runs;
        std::vector<double> sampling;
        for (int r = 0; r < options.whole("runs", 5); ++r) {
            surface = {};
            sampling.push_back(0);
            runs.time([&] { surface = mesh(grid, sampling.back()); });
        }
        write_mesh(options.word(2, "an output file"), surface.points.data()->asPointer(), surface.points.size(),
                   outward(surface));
        runs.line().add("sampling_s", median(sampling)).add("evals", double(surface.evaluations))
            .add("leaves", double(surface.leaves)).add("worker_peak_mb", peak_mb()).print();
    });
}
