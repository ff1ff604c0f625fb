// Bricks <-> OpenVDB: the extension module fracslice._vdb. Its Python face and its documentation are in ../../_vdb.pyi.
//
// Python extensions are built with hidden visibility. OpenVDB's templates hold once-flags and type registries that must be
// the same objects here and in libopenvdb, so its headers need default visibility, or openvdb::initialize() crashes.
#pragma GCC visibility push(default)
#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Count.h>
#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/ValueTransformer.h>
#pragma GCC visibility pop

#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "../array.h"
#include "brick_arrays.h"

namespace fracslice::volume {

using FloatGrid = openvdb::FloatGrid;
using Metadata = std::map<std::string, std::string>;

struct BrickArrays {
    Array<int32_t> ijk;
    Array<float> values;
    Array<int32_t> index;
    std::array<size_t, 3> size;
    std::array<int32_t, 3> shift;  // grid index of point (0, 0, 0) of the arrays
};

// A level set: active where sampled; the background is the largest sample; unsampled inside bricks are inactive tiles.
FloatGrid::Ptr grid_from_bricks(const Bricks& bricks, const std::array<double, 3>& origin, double voxel);
BrickArrays bricks_from_grid(const FloatGrid& grid);

// Origin and spacing of the grid's points. Throws std::invalid_argument unless the voxels are axis-aligned cubes.
std::pair<std::array<double, 3>, double> placement_of(const FloatGrid& grid);

// Both throw std::runtime_error with the path, also for a full disk, which OpenVDB does not report.
void write_grid(const FloatGrid::Ptr& grid, const std::string& path, const Metadata& metadata);
FloatGrid::Ptr read_grid(const std::string& path, const std::string& name);

// A field that is not a distance, made one in scene units around the same surface (fast sweeping, Zhao 2004).
FloatGrid::Ptr redistance(const FloatGrid& grid);
// The surface moved outwards by `distance` scene units; negative: inwards. The grid must hold distances.
FloatGrid::Ptr offset(const FloatGrid& grid, double distance);

}  // namespace fracslice::volume

namespace fracslice::volume {
namespace {

using openvdb::Coord;
using Leaf = FloatGrid::TreeType::LeafNodeType;

float largest(const Bricks& bricks) {
    return tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, bricks.count * kSamples), 0.f,
        [&](const tbb::blocked_range<size_t>& range, float most) {
            for (size_t i = range.begin(); i < range.end(); ++i) most = std::max(most, std::fabs(bricks.values[i]));
            return most;
        },
        [](float a, float b) { return std::max(a, b); });
}

Coord first_sample(int x, int y, int z) { return {x * kSide, y * kSide, z * kSide}; }

Coord brick_of(const Bricks& bricks, size_t row) {
    const int32_t* p = bricks.ijk + 3 * row;
    return {p[0], p[1], p[2]};
}

void fill_inside(const Bricks& bricks, FloatGrid::TreeType& tree) {
    const int32_t* at = bricks.index;
    for (int x = 0; x < bricks.size[0]; ++x) {
        for (int y = 0; y < bricks.size[1]; ++y) {
            for (int z = 0; z < bricks.size[2]; ++z) {
                if (*at++ == kInside) tree.addTile(1, first_sample(x, y, z), -tree.background(), false);
            }
        }
    }
}

std::vector<const Leaf*> sorted_leaves(const FloatGrid& grid) {
    std::vector<const Leaf*> leaves;
    leaves.reserve(grid.tree().leafCount());
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
    std::sort(leaves.begin(), leaves.end(), [](auto* a, auto* b) { return a->origin() < b->origin(); });
    return leaves;
}

// What the archive class keeps to itself: a whole seekable file on a stream whose state can be asked for afterwards.
struct Archive : openvdb::io::Archive {
    using openvdb::io::Archive::write;
    Ptr copy() const override { return Ptr(new Archive(*this)); }
};

}  // namespace

FloatGrid::Ptr grid_from_bricks(const Bricks& bricks, const std::array<double, 3>& origin, double voxel) {
    check(bricks);
    auto grid = FloatGrid::create(largest(bricks));
    auto& tree = grid->tree();
    std::vector<Leaf*> leaves(bricks.count);
    tbb::parallel_for(size_t(0), bricks.count, [&](size_t row) {
        leaves[row] = new Leaf(brick_of(bricks, row), tree.background(), true);
        std::copy_n(bricks.values + row * kSamples, kSamples, leaves[row]->buffer().data());
    });
    for (Leaf* leaf : leaves) tree.addLeaf(leaf);
    fill_inside(bricks, tree);
    openvdb::tools::pruneTiles(tree);
    auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    transform->postTranslate({origin[0], origin[1], origin[2]});
    grid->setTransform(transform);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

BrickArrays bricks_from_grid(const FloatGrid& grid) {
    auto leaves = sorted_leaves(grid);
    Coord low(0), high(0);
    for (const Leaf* leaf : leaves) {
        low.minComponent(leaf->origin());
        high.maxComponent(leaf->origin() + Coord(kSide));
    }
    BrickArrays out;
    Coord size = (high - low) >> 3;
    out.shift = {low[0], low[1], low[2]};
    out.size = {size_t(size[0]), size_t(size[1]), size_t(size[2])};
    out.ijk = {leaves.size(), 3};
    out.values = {leaves.size(), kSamples};
    out.index = {out.size[0] * out.size[1] * out.size[2], 1};
    tbb::parallel_for(size_t(0), out.size[0], [&](size_t x) {
        auto tree = grid.getConstAccessor();
        int32_t* at = out.index.data.get() + x * out.size[1] * out.size[2];
        for (int y = 0; y < size[1]; ++y) {
            for (int z = 0; z < size[2]; ++z) {
                *at++ = tree.getValue(low + first_sample(int(x), y, z)) < 0 ? kInside : kOutside;
            }
        }
    });
    tbb::parallel_for(size_t(0), leaves.size(), [&](size_t row) {
        Coord p = leaves[row]->origin() - low;
        for (int k = 0; k < 3; ++k) out.ijk.data[3 * row + k] = p[k];
        std::copy_n(leaves[row]->buffer().data(), kSamples, out.values.data.get() + row * kSamples);
        out.index.data[((p[0] >> 3) * out.size[1] + (p[1] >> 3)) * out.size[2] + (p[2] >> 3)] = int32_t(row);
    });
    return out;
}

std::pair<std::array<double, 3>, double> placement_of(const FloatGrid& grid) {
    const auto& transform = grid.transform();
    auto origin = transform.indexToWorld(openvdb::Vec3d(0));
    double voxel = transform.voxelSize()[0];
    bool cubes = transform.isLinear();
    for (int k = 0; k < 3 && cubes; ++k) {
        openvdb::Vec3d unit(0), expected = origin;
        unit[k] = 1;
        expected[k] += voxel;
        cubes = (transform.indexToWorld(unit) - expected).length() <= 1e-6 * voxel;
    }
    if (!cubes) throw std::invalid_argument("its voxels are not axis-aligned cubes");
    return {{origin[0], origin[1], origin[2]}, voxel};
}

void write_grid(const FloatGrid::Ptr& grid, const std::string& path, const Metadata& metadata) {
    for (const auto& [name, text] : metadata) grid->insertMeta(name, openvdb::StringMetadata(text));
    errno = 0;
    std::ofstream file(path, std::ios::binary);
    if (file) {
        Archive().write(file, openvdb::GridCPtrVec{grid}, true);
        file.close();
    }
    if (!file) throw std::runtime_error(path + ": " + (errno ? std::strerror(errno) : "cannot be written"));
}

FloatGrid::Ptr read_grid(const std::string& path, const std::string& name) {
    try {
        openvdb::io::File file(path);
        file.open(false);  // no delayed loading: nothing may depend on the file once this returns
        for (auto result = file.beginName(); result != file.endName(); ++result) {
            if (!name.empty() && result.gridName() != name) continue;
            auto grid = openvdb::gridPtrCast<FloatGrid>(file.readGrid(result.gridName()));
            if (grid) return grid;
        }
    } catch (const std::exception& error) {
        throw std::runtime_error(path + ": " + error.what());
    }
    throw std::runtime_error(path + ": no float grid" + (name.empty() ? "" : " named " + name));
}

namespace {

// The background must stay beyond all samples, or inactive points would lie nearer to the surface than active ones.
void fit_background(FloatGrid& grid) {
    auto range = openvdb::tools::minMax(grid.tree());
    double most = std::max(std::fabs(range.min()), std::fabs(range.max()));
    openvdb::tools::changeLevelSetBackground(grid.tree(), float(most));
}

}  // namespace

FloatGrid::Ptr redistance(const FloatGrid& grid) {
    auto distances = openvdb::tools::sdfToSdf(grid);
    if (!distances) throw std::invalid_argument("the grid holds no surface");
    fit_background(*distances);
    return distances;
}

FloatGrid::Ptr offset(const FloatGrid& grid, double distance) {
    // Two voxels beyond the new surface, so that every cell it passes has samples at all corners.
    int reach = int(std::ceil(std::fabs(distance) / grid.voxelSize()[0])) + 2;
    // Only to the side that the surface moves to.
    using openvdb::tools::FastSweepingDomain;
    auto side = distance < 0 ? FastSweepingDomain::SWEEP_LESS_THAN_ISOVALUE : FastSweepingDomain::SWEEP_GREATER_THAN_ISOVALUE;
    auto moved = openvdb::tools::dilateSdf(grid, reach, openvdb::tools::NN_FACE, 1, side);
    if (!moved) throw std::invalid_argument("the grid holds no surface");
    fit_background(*moved);
    float by = float(distance);
    openvdb::tools::foreach(moved->beginValueOn(), [by](const FloatGrid::ValueOnIter& v) { v.setValue(*v - by); });
    fit_background(*moved);
    openvdb::tools::pruneLevelSet(moved->tree());
    return moved;
}

}  // namespace fracslice::volume

namespace fracslice::volume {
namespace {

struct Grid {
    FloatGrid::Ptr vdb;
};

Grid from_bricks(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index,
                 const std::array<double, 3>& origin, double voxel) {
    Bricks bricks = view(ijk, values, index);
    nb::gil_scoped_release released;
    return {grid_from_bricks(bricks, origin, voxel)};
}

nb::tuple to_bricks(const Grid& grid) {
    BrickArrays out;
    {
        nb::gil_scoped_release released;
        out = bricks_from_grid(*grid.vdb);
    }
    auto [origin, voxel] = placement_of(*grid.vdb);
    for (int k = 0; k < 3; ++k) origin[k] += voxel * out.shift[k];
    size_t n = out.ijk.rows;
    auto [x, y, z] = out.size;
    return nb::make_tuple(origin, voxel, to_numpy(std::move(out.ijk), {n, 3}),
                          to_numpy(std::move(out.values), {n, kSamples}), to_numpy(std::move(out.index), {x, y, z}));
}

}  // namespace
}  // namespace fracslice::volume

NB_MODULE(_vdb, module) {
    namespace nb = nanobind;
    using namespace fracslice::volume;
    using namespace nanobind::literals;
    nb::set_leak_warnings(false);  // the command exits without a search for garbage
    using released = nb::call_guard<nb::gil_scoped_release>;
    openvdb::initialize();
    nb::class_<Grid>(module, "Grid")
        .def_static("from_bricks", &from_bricks, "ijk"_a, "values"_a, "index"_a, "origin"_a, "voxel"_a)
        .def_static("read", [](const std::string& path, const std::string& name) { return Grid{read_grid(path, name)}; },
                    "path"_a, "name"_a = "", released())
        .def("write", [](const Grid& g, const std::string& path, const Metadata& metadata) { write_grid(g.vdb, path, metadata); },
             "path"_a, "metadata"_a, released())
        .def("to_bricks", &to_bricks)
        .def("redistance", [](const Grid& g) { return Grid{redistance(*g.vdb)}; }, released())
        .def("offset", [](const Grid& g, double distance) { return Grid{offset(*g.vdb, distance)}; }, "distance"_a, released())
        .def_prop_rw("name", [](const Grid& g) { return g.vdb->getName(); },
                     [](Grid& g, const std::string& name) { g.vdb->setName(name); });
}
