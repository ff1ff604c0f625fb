// The extension module fracslice._native. Its Python face and its documentation are in ../_native.pyi.
#include <tbb/task_arena.h>

#include "contour.h"
#include "numpy.h"
#include "signs.h"

namespace fracslice {
namespace {

// Runs without the interpreter's lock, on so many threads (0: all cores).
template <class Do>
auto unlocked(int threads, const Do& act) {
    nb::gil_scoped_release released;
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    return arena.execute(act);
}

nb::tuple bind_marching_cubes(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index,
                              const std::array<double, 3>& origin, double voxel, double clamp, int threads) {
    Bricks bricks = view(ijk, values, index);
    Surface surface = unlocked(threads, [&] { return marching_cubes(bricks, {origin, voxel, clamp}); });
    size_t n = surface.vertices.rows, m = surface.triangles.rows;
    return nb::make_tuple(to_numpy(std::move(surface.vertices), {n, 3}), to_numpy(std::move(surface.triangles), {m, 3}),
                          to_numpy(std::move(surface.lower), {n, 3}), to_numpy(std::move(surface.axis), {n}));
}

nb::tuple bind_crossed_edges(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index, int threads) {
    Bricks bricks = view(ijk, values, index);
    CrossedEdges found = unlocked(threads, [&] { return crossed_edges(bricks); });
    size_t n = found.axis.rows;
    return nb::make_tuple(to_numpy(std::move(found.lower), {n, 3}), to_numpy(std::move(found.axis), {n}));
}

nb::tuple bind_contour(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index, const RootsArray& t,
                       const NormalsArray& normals, const std::array<double, 3>& origin, double voxel, double clamp,
                       int threads) {
    Bricks bricks = view(ijk, values, index);
    if (t.shape(0) != normals.shape(0)) throw nb::value_error("t and normals differ in length");
    Hermite data{t.data(), normals.data(), t.shape(0)};
    Contour surface = unlocked(threads, [&] { return contour(bricks, data, {origin, voxel, clamp}); });
    size_t n = surface.vertices.rows, m = surface.triangles.rows;
    return nb::make_tuple(to_numpy(std::move(surface.vertices), {n, 3}), to_numpy(std::move(surface.triangles), {m, 3}),
                          surface.crossings, surface.corners);
}

int64_t bind_open_edges(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index) {
    Bricks bricks = view(ijk, values, index);
    nb::gil_scoped_release released;
    check(bricks);
    return open_edges(bricks, signs_of(bricks));
}

}  // namespace
}  // namespace fracslice

NB_MODULE(_native, module) {
    using namespace nanobind::literals;
    module.def("marching_cubes", &fracslice::bind_marching_cubes, "ijk"_a, "values"_a, "index"_a, "origin"_a, "voxel"_a,
               "clamp"_a, "threads"_a = 0);
    module.def("crossed_edges", &fracslice::bind_crossed_edges, "ijk"_a, "values"_a, "index"_a, "threads"_a = 0);
    module.def("contour", &fracslice::bind_contour, "ijk"_a, "values"_a, "index"_a, "t"_a, "normals"_a, "origin"_a, "voxel"_a,
               "clamp"_a, "threads"_a = 0);
    module.def("open_edges", &fracslice::bind_open_edges, "ijk"_a, "values"_a, "index"_a);
    fracslice::bind_grid(module);
}
