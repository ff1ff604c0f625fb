// The extension module fracslice._vdb. Its Python face and its documentation are in ../../_vdb.pyi.
#include "brick_arrays.h"
#include "level_set.h"

#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

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

using DenseArray = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

Grid from_array(const DenseArray& values, const std::array<double, 3>& origin, const std::array<double, 3>& spacing, float beyond) {
    if (!values.size()) throw nb::value_error("an empty array");
    return released([&] {
        return Grid{grid_from_array(values.data(), {values.shape(0), values.shape(1), values.shape(2)}, origin, spacing, beyond)};
    });
}

class BoundLevelSet {
  public:
    explicit BoundLevelSet(const Grid& grid) : level_set_(*grid.vdb) {}

    uintptr_t address() const { return reinterpret_cast<uintptr_t>(level_set_.entry()); }
    nb::object distances(const Rows<double>& points) const {
        Array<double> values(points.shape(0), 1);
        size_t found = 0;
        for (size_t i = 0; i < points.shape(0); ++i) values.data[i] = level_set_(points.data() + 3 * i, found);
        return to_numpy(std::move(values), {points.shape(0)});
    }
    std::array<std::array<double, 3>, 2> box() const { return level_set_.box(); }
    std::optional<std::array<std::array<double, 3>, 6>> tips() const { return level_set_.tips(); }
    double steepness() const { return level_set_.steepness(); }

  private:
    LevelSet level_set_;
};

std::string class_of(const Grid& grid) { return openvdb::GridBase::gridClassToString(grid.vdb->getGridClass()); }

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
        .def_static("from_array", &from_array, "values"_a, "origin"_a, "spacing"_a, "beyond"_a)
        .def("with_cubes", [](const Grid& g) { return Grid{with_cubes(g.vdb)}; }, released())
        .def("less", [](const Grid& g, float iso, bool turned) { return Grid{less(*g.vdb, iso, turned)}; }, "iso"_a, "turned"_a,
             released())
        .def("narrow_band", [](const Grid& g) { return Grid{narrow_band(*g.vdb)}; }, released())
        .def("fog", [](const Grid& g) { return Grid{fog(*g.vdb)}; }, released())
        .def_prop_ro("kind", &class_of)
        .def_prop_rw("half", [](const Grid& g) { return g.vdb->saveFloatAsHalf(); },
                     [](Grid& g, bool half) { g.vdb->setSaveFloatAsHalf(half); })
        .def_prop_rw("name", [](const Grid& g) { return printable(g.vdb->getName()); },
                     [](Grid& g, const std::string& name) { g.vdb->setName(name); });
    module.def("grids_of", &grids_of, "path"_a, released());
    module.def("level_set_of", [](const Grid& g) { return Grid{level_set_of(*g.vdb)}; }, "grid"_a, released());
    nb::class_<BoundLevelSet>(module, "LevelSet")
        .def(nb::init<const Grid&>(), "grid"_a, released())
        .def("distances", &BoundLevelSet::distances, "points"_a)
        .def_prop_ro("address", &BoundLevelSet::address)
        .def_prop_ro("box", &BoundLevelSet::box)
        .def_prop_ro("tips", &BoundLevelSet::tips)
        .def_prop_ro("steepness", &BoundLevelSet::steepness);
}
