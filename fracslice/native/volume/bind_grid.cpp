// The extension module fracslice._vdb. Its Python face and its documentation are in ../../_vdb.pyi.
#include "brick_arrays.h"
#include "grid.h"

#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>

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
