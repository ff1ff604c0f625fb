#include "grid.h"

#pragma GCC visibility push(default)
#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Count.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/GridTransformer.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/ValueTransformer.h>
#pragma GCC visibility pop

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>

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

// What the archive class keeps to itself: a whole seekable file on a stream whose state can be asked for afterwards.
struct Archive : openvdb::io::Archive {
    using openvdb::io::Archive::write;
    Ptr copy() const override { return Ptr(new Archive(*this)); }
};

}  // namespace

std::vector<const Leaf*> sorted_leaves(const FloatGrid::TreeType& tree) {
    std::vector<const Leaf*> leaves;
    leaves.reserve(tree.leafCount());
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
    std::sort(leaves.begin(), leaves.end(), [](auto* a, auto* b) { return a->origin() < b->origin(); });
    return leaves;
}

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
    auto leaves = sorted_leaves(grid.tree());
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

namespace {

using Grids = openvdb::GridBase;

// A grid of other numbers as one of floats; null if it is of another type.
template <class Other>
FloatGrid::Ptr numbers_of(const Grids::Ptr& grid) {
    const auto other = openvdb::gridPtrCast<Other>(grid);
    return other ? FloatGrid::create(std::make_shared<FloatGrid::TreeType>(other->tree())) : nullptr;
}

// 1 where a mask is active, and true if it holds bits.
template <class Other>
FloatGrid::Ptr mask_of(const Grids::Ptr& grid) {
    const auto other = openvdb::gridPtrCast<Other>(grid);
    if (!other) return nullptr;
    auto made = FloatGrid::create(std::make_shared<FloatGrid::TreeType>(other->tree(), 0.f, 1.f, openvdb::TopologyCopy()));
    if constexpr (std::is_same_v<Other, openvdb::BoolGrid>) {
        for (auto value = other->cbeginValueOn(); value; ++value) {
            if (!*value) made->tree().fill(value.getBoundingBox(), 0.f, true);
        }
    }
    return made;
}

FloatGrid::Ptr floats_of(const Grids::Ptr& grid) {
    if (auto floats = openvdb::gridPtrCast<FloatGrid>(grid)) return floats;
    using Convert = FloatGrid::Ptr (*)(const Grids::Ptr&);
    constexpr Convert kinds[] = {&numbers_of<openvdb::DoubleGrid>, &numbers_of<openvdb::Int32Grid>, &numbers_of<openvdb::Int64Grid>,
                                 &mask_of<openvdb::BoolGrid>, &mask_of<openvdb::MaskGrid>};
    for (Convert convert : kinds) {
        if (auto floats = convert(grid)) {
            floats->setTransform(grid->transformPtr());
            floats->setGridClass(grid->getGridClass());
            floats->setName(grid->getName());
            return floats;
        }
    }
    return nullptr;
}

// OpenVDB itself writes a warning about other versions to standard output.
void require_known(const std::string& path) {
    int64_t magic = 0;
    uint32_t version = 0;
    std::ifstream file(path, std::ios::binary);
    file.read(reinterpret_cast<char*>(&magic), sizeof magic).read(reinterpret_cast<char*>(&version), sizeof version);
    if (!file || magic != openvdb::OPENVDB_MAGIC || version > openvdb::OPENVDB_FILE_VERSION) throw std::runtime_error("unknown");
}

// What act() makes of an open file. No delayed loading: nothing may depend on the file once this returns.
template <class Act>
auto from_file(const std::string& path, const Act& act) {
    try {
        require_known(path);
        openvdb::io::File file(path);
        file.open(false);
        return act(file);
    } catch (const std::exception&) {  // OpenVDB's texts are of its own making
        throw std::runtime_error(path + ": not a whole OpenVDB file: it is cut short, or of another kind");
    }
}

}  // namespace

std::string printable(std::string name) {
    for (char& c : name) {
        if (c < ' ' || c > '~') c = '?';
    }
    return name;
}

FloatGrid::Ptr read_grid(const std::string& path, const std::string& name) {
    const auto found = from_file(path, [&](openvdb::io::File& file) {
        for (auto each = file.beginName(); each != file.endName(); ++each) {
            if (!name.empty() && printable(each.gridName()) != name) continue;
            if (auto grid = floats_of(file.readGrid(each.gridName()))) return grid;
        }
        return FloatGrid::Ptr();
    });
    if (!found) throw std::runtime_error(path + ": no grid of numbers" + (name.empty() ? "" : " named " + name));
    return found;
}

std::vector<std::string> grids_of(const std::string& path) {
    return from_file(path, [](openvdb::io::File& file) {
        std::vector<std::string> found;
        for (auto each = file.beginName(); each != file.endName(); ++each) {
            found.push_back(printable(each.gridName()));
        }
        return found;
    });
}

namespace {

constexpr openvdb::Index64 kMostSamples = 1 << 27, kMostOfTiles = 1 << 24;

void require_few(openvdb::Index64 samples, openvdb::Index64 most = kMostSamples) {
    if (samples > most) throw std::invalid_argument("takes more than " + std::to_string(most) + " samples");
}

openvdb::Vec3d axis_of(const FloatGrid& grid, int k) {
    openvdb::Vec3d unit(0);
    unit[k] = 1;
    return grid.transform().indexToWorld(unit) - grid.transform().indexToWorld(openvdb::Vec3d(0));
}

}  // namespace

bool along_axes(const FloatGrid& grid) {
    for (int k = 0; k < 3; ++k) {
        const openvdb::Vec3d axis = openvdb::math::Abs(axis_of(grid, k));
        if (axis[0] + axis[1] + axis[2] > (1 + 1e-12) * axis.length()) return false;
    }
    return true;
}

FloatGrid::Ptr grid_from_array(const float* values, const std::array<size_t, 3>& size, const std::array<double, 3>& origin,
                               const std::array<double, 3>& spacing, float beyond) {
    using Dense = openvdb::tools::Dense<const float, openvdb::tools::LayoutZYX>;
    const Coord last(int(size[0]) - 1, int(size[1]) - 1, int(size[2]) - 1);
    auto grid = FloatGrid::create(beyond);
    openvdb::tools::copyFromDense(Dense({Coord(0), last}, values), *grid, 0.f, true);
    auto transform = openvdb::math::Transform::createLinearTransform();
    transform->postScale(openvdb::Vec3d(spacing[0], spacing[1], spacing[2]));
    transform->postTranslate(openvdb::Vec3d(origin[0], origin[1], origin[2]));
    grid->setTransform(transform);
    return grid;
}

FloatGrid::Ptr with_cubes(const FloatGrid::Ptr& grid) {
    if (!grid->transform().isLinear()) throw std::invalid_argument("has no linear transform");
    std::array<openvdb::Vec3d, 3> axes;
    openvdb::Vec3d length;
    for (int k = 0; k < 3; ++k) axes[size_t(k)] = axis_of(*grid, k), length[k] = axes[size_t(k)].length();
    const double shortest = openvdb::math::Min(length[0], length[1], length[2]);
    const double longest = openvdb::math::Max(length[0], length[1], length[2]);
    bool square = std::isfinite(longest) && shortest > 0;
    for (size_t k = 0; k < 3; ++k) {
        const size_t next = (k + 1) % 3;
        square = square && std::abs(axes[k].dot(axes[next])) <= 1e-6 * length[int(k)] * length[int(next)];
    }
    if (!square) throw std::invalid_argument("has axes that are not at right angles");
    if (longest <= (1 + 1e-6) * shortest) return grid;
    const double more = length[0] * length[1] * length[2] / (shortest * shortest * shortest);
    require_few(openvdb::Index64(double(grid->activeVoxelCount()) * std::min(more, double(kMostSamples))));
    openvdb::Mat4d matrix = openvdb::Mat4d::identity();
    for (int k = 0; k < 3; ++k) {
        for (int x = 0; x < 3; ++x) matrix[k][x] = axes[size_t(k)][x] * (shortest / length[k]);
    }
    const openvdb::Vec3d origin = grid->transform().indexToWorld(openvdb::Vec3d(0));
    for (int x = 0; x < 3; ++x) matrix[3][x] = origin[x];
    auto cubes = FloatGrid::create(grid->background());
    cubes->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
    const auto given = grid->getGridClass();
    grid->setGridClass(openvdb::GRID_UNKNOWN);  // a level set would be made anew, by triangles
    openvdb::tools::resampleToMatch<openvdb::tools::BoxSampler>(*grid, *cubes);
    cubes->setGridClass(given);
    cubes->setName(grid->getName());
    return cubes;
}

FloatGrid::Ptr less(const FloatGrid& grid, float iso, bool turned) {
    const openvdb::Index64 samples = grid.activeVoxelCount();
    require_few(samples), require_few(samples - grid.tree().activeLeafVoxelCount(), kMostOfTiles);
    auto made = grid.deepCopy();
    made->tree().voxelizeActiveTiles();
    const auto apart = [=](float value) { return turned ? iso - value : value - iso; };
    made->tree().root().setBackground(apart(grid.background()), false);
    for (auto tile = made->beginValueAll(); tile; ++tile) tile.setValue(apart(*tile));
    return made;
}

FloatGrid::Ptr fog(const FloatGrid& grid) {
    auto made = grid.deepCopy();
    const float width = 2 * grid.background();
    made->tree().root().setBackground(0.f, false);
    for (auto value = made->beginValueAll(); value; ++value) {
        const float density = std::clamp(0.5f - *value / width, 0.f, 1.f);
        value.setValue(density);
        value.setActiveState(density > 0);
    }
    openvdb::tools::prune(made->tree());
    made->setGridClass(openvdb::GRID_FOG_VOLUME);
    return made;
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
