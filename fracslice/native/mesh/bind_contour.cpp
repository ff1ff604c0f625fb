// Extraction of surfaces, for fracslice._native.

#include <algorithm>

#include "../unlocked.h"
#include "../volume/bind_field.h"
#include "../volume/brick_arrays.h"
#include "contour.h"
#include "roots.h"

// Loops over a field, compiled or in Python, as native code calls them.

namespace fracslice::mesh {

namespace nb = nanobind;

template <size_t, class T>
using Repeat = T;

// A compiled loop of some rows of n numbers and of those that it writes.
template <class Real, size_t... I, size_t... O>
auto compiled(const Machine<Real>& code, std::index_sequence<I...>, std::index_sequence<O...>) {
    using R = const Real*;
    auto run = code.template function<R, R, Repeat<I, R>..., Repeat<O, Real*>..., ptrdiff_t>();
    return [code, run, p = code.array(1), frame = code.array(2)](R in, Real* out, size_t n) {
        run(p, frame, in + I * n..., out + O * n..., ptrdiff_t(n));
    };
}

// A Python function of some rows of n numbers and of those that it writes.
template <class Real>
void call(const nb::object& function, const Real* in, size_t in_rows, Real* out, size_t out_rows, size_t n) {
    nb::gil_scoped_acquire locked;
    auto view = [n](auto* p, size_t count) {
        return nb::cast(nb::ndarray<nb::numpy, Real, nb::ndim<2>>(const_cast<Real*>(p), {count, n}, nb::handle()),
                        nb::rv_policy::reference);
    };
    function(view(in, in_rows), view(out, out_rows));
}

// A loop that is either.
template <class Real, size_t In, size_t Out>
SegmentLoop<Real> loop_of(nb::object loop) {
    if (nb::isinstance<nb::tuple>(loop)) {
        return compiled<Real>(Machine<Real>(loop), std::make_index_sequence<In>(), std::make_index_sequence<Out>());
    }
    return [=](const Real* in, Real* out, size_t n) { call(loop, in, In, out, Out, n); };
}

inline RootLoops root_loops(size_t lanes, size_t batch, nb::object guess, nb::object find, nb::object polish, nb::object field,
                            double sure) {
    return {lanes, batch, loop_of<float, 6, 1>(guess), loop_of<double, 6, 1>(find), loop_of<double, 6, 5>(polish),
            volume::field_values(field), sure};
}

inline ProjectionLoops projection_loops(size_t lanes, nb::object lead, nb::object guess, nb::object find, nb::object aim,
                                        nb::object field) {
    return {lanes, loop_of<float, 15, 3>(lead), loop_of<float, 6, 1>(guess), loop_of<double, 6, 1>(find),
            loop_of<double, 6, 2>(aim), volume::field_values(field)};
}

// A Python function of numbers of points and marks of those inside; it returns the rows of TrustRegions.
inline TrustRegions trust_regions_by(nb::object function) {
    return [=](std::span<const int64_t> which, const bool* inside, double* out) {
        nb::gil_scoped_acquire locked;
        const size_t n = which.size();
        Array<int64_t> numbers(n, 1);
        Array<bool> marks(n, 1);
        std::copy(which.begin(), which.end(), numbers.data.get());
        std::copy_n(inside, n, marks.data.get());
        auto rows = nb::cast<nb::ndarray<const double, nb::shape<4, 3, -1>, nb::c_contig, nb::device::cpu>>(
            function(to_numpy(std::move(numbers), {n}), to_numpy(std::move(marks), {n})));
        if (rows.shape(2) != n) throw nb::value_error("expected as many trust regions as points");
        std::copy_n(rows.data(), rows.size(), out);
    };
}

namespace {

using volume::IjkArray, volume::IndexArray, volume::SignsArray, volume::ValuesArray;
using RootsArray = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using NormalsArray = nb::ndarray<const float, nb::shape<3, -1>, nb::device::cpu>;
using RootsOut = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using NormalsOut = nb::ndarray<float, nb::shape<3, -1>, nb::device::cpu>;

nb::tuple bind_marching_cubes(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index,
                              const std::array<double, 3>& origin, double voxel, double margin, int threads) {
    Bricks bricks = volume::view(ijk, values, index);
    Surface surface = unlocked(threads, [&] { return marching_cubes(bricks, {origin, voxel, margin}); });
    size_t n = surface.vertices.rows, m = surface.triangles.rows;
    return nb::make_tuple(to_numpy(std::move(surface.vertices), {n, 3}), to_numpy(std::move(surface.triangles), {m, 3}));
}

// The cells of a surface, kept from one piece of it to the next together with the arrays they look into.
class SurfaceCells {
  public:
    SurfaceCells(const IjkArray& ijk, const SignsArray& signs, const IndexArray& index, int threads)
        : ijk_(ijk), index_(index), threads_(threads),
          grid_(unlocked(threads, [&] { return CellGrid(volume::layout(ijk, index), sign_rows(ijk, signs)); })) {}

    nb::object edges(size_t begin, size_t end) const {
        check(begin, end);
        Array<int16_t> rows(end - begin, 4);
        unlocked(threads_, [&] { grid_.edges(begin, end, rows.data.get()); });
        return to_numpy(std::move(rows), {end - begin, 4});
    }

    void find_crossings(size_t begin, size_t end, const std::array<double, 3>& origin, double voxel, const RootLoops& loops,
                        const RootsOut& t, const NormalsOut& normals) const {
        check(begin, end);
        if (t.shape(0) != end - begin || normals.shape(1) != end - begin) throw nb::value_error("as many rows as crossings");
        unlocked(threads_, [&] {
            mesh::find_crossings(grid_, loops, begin, end, origin, voxel, t.data(), normals.data(),
                                 size_t(normals.stride(0)));
        });
    }

    size_t crossings_before(int layer) const { return grid_.crossings_before(layer); }

    const CellGrid& grid() const { return grid_; }
    int threads() const { return threads_; }

  private:
    void check(size_t begin, size_t end) const {
        if (begin > end || end > grid_.vertices()) throw nb::value_error("no such crossings");
    }

    static std::vector<Signs> sign_rows(const IjkArray& ijk, const SignsArray& signs) {
        if (ijk.shape(0) != signs.shape(0)) throw nb::value_error("ijk and signs differ in length");
        std::vector<Signs> rows(signs.shape(0));
        std::copy_n(signs.data(), signs.size(), reinterpret_cast<uint8_t*>(rows.data()));
        return rows;
    }

    IjkArray ijk_;
    IndexArray index_;
    int threads_;
    CellGrid grid_;
};

// The surface in some layers of cells, while it is made.
class Surfacing {
  public:
    Surfacing(const SurfaceCells& cells, int first, int last, const std::array<double, 3>& origin, double voxel, double margin)
        : threads_(cells.threads()), margin_(margin), made_(cells.grid(), {first, last}, {origin, voxel, margin}) {}

    void advance(int end, size_t first, const RootsArray& t, const NormalsArray& normals) {
        if (t.shape(0) != normals.shape(1)) throw nb::value_error("t and normals differ in length");
        if (normals.stride(1) != 1) throw nb::value_error("each row of normals contiguous");
        Hermite data{first, t.shape(0), size_t(normals.stride(0)), t.data(), normals.data(), margin_};
        unlocked(threads_, [&] { made_.advance(end, data); });
    }

    nb::tuple finish() {
        Contour surface = made_.finish();
        size_t n = surface.vertices.rows, m = surface.triangles.rows, k = surface.cases.rows;
        size_t b = surface.blunt.size() / 3;
        Array<double> blunt(b, 3);
        std::copy(surface.blunt.begin(), surface.blunt.end(), blunt.data.get());
        return nb::make_tuple(to_numpy(std::move(surface.vertices), {n, 3}), to_numpy(std::move(surface.triangles), {m, 3}),
                              surface.crossings, to_numpy(std::move(surface.cases), {k}),
                              to_numpy(std::move(surface.to_means), {k, 3}), to_numpy(std::move(blunt), {b, 3}));
    }

  private:
    int threads_;
    double margin_;
    Contouring made_;
};

template <class T, class Shape>
using In = nb::ndarray<const T, Shape, nb::c_contig, nb::device::cpu>;

nb::object bind_trust_regions(const In<double, nb::shape<-1, 3>>& points, const In<uint8_t, nb::ndim<1>>& cases,
                              const In<float, nb::shape<-1, 3>>& to_means, const In<int64_t, nb::ndim<1>>& which,
                              const In<bool, nb::ndim<1>>& inside, const std::array<double, 3>& origin, double voxel,
                              double margin) {
    size_t rows = points.shape(0), count = which.size();
    if (cases.size() != rows || to_means.shape(0) != rows || inside.size() != count) throw nb::value_error("differ in length");
    Array<double> out(12, count);
    {
        nb::gil_scoped_release released;
        for (size_t i = 0; i < count; ++i) {
            if (which.data()[i] < 0 || size_t(which.data()[i]) >= rows) throw std::invalid_argument("no such feature");
        }
        trust_regions({points.data(), to_means.data(), cases.data()}, {which.data(), count}, {inside.data(), count},
                      {origin, voxel, margin}, out.data.get());
    }
    return to_numpy(std::move(out), {4, 3, count});
}

void bind_project(const nb::ndarray<double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>& points, size_t first, size_t last,
                  const ProjectionLoops& loops, nb::object regions, double voxel, int threads) {
    if (first > last || last > points.shape(0)) throw nb::value_error("no such points");
    const TrustRegions within = trust_regions_by(regions);
    unlocked(threads, [&] { project(points.data(), first, last, loops, within, voxel); });
}

}  // namespace

void bind_contour(nb::module_& module) {
    using namespace nanobind::literals;
    module.def("marching_cubes", &bind_marching_cubes, "ijk"_a, "values"_a, "index"_a, "origin"_a, "voxel"_a,
               "minimum_edge_parameter"_a, "threads"_a = 0);
    module.def("trust_regions", &bind_trust_regions, "features"_a, "cases"_a, "to_means"_a, "which"_a, "inside"_a, "origin"_a,
               "voxel"_a, "minimum_edge_parameter"_a);
    module.def("project", &bind_project, "points"_a, "first"_a, "last"_a, "loops"_a, "trust_regions"_a, "voxel"_a, "threads"_a = 0);
    nb::class_<ProjectionLoops>(module, "ProjectionLoops")
        .def(nb::new_(&projection_loops), "lanes"_a, "lead"_a, "guess"_a, "find"_a, "aim"_a, "field"_a);
    nb::class_<RootLoops>(module, "RootLoops")
        .def(nb::new_(&root_loops), "lanes"_a, "batch"_a, "guess"_a, "find"_a, "polish"_a, "field"_a,
             "sure"_a);
    nb::class_<SurfaceCells>(module, "Cells")
        .def(nb::init<const IjkArray&, const SignsArray&, const IndexArray&, int>(),
             "ijk"_a, "signs"_a, "index"_a, "threads"_a = 0)
        .def("edges", &SurfaceCells::edges, "begin"_a, "end"_a)
        .def("find_crossings", &SurfaceCells::find_crossings, "begin"_a, "end"_a, "origin"_a, "voxel"_a, "loops"_a, "t"_a, "normals"_a)
        .def("crossings_before", &SurfaceCells::crossings_before, "layer"_a);
    nb::class_<Surfacing>(module, "Contouring")
        .def(nb::init<const SurfaceCells&, int, int, const std::array<double, 3>&, double, double>(),
             nb::keep_alive<1, 2>(), "cells"_a, "first"_a, "last"_a, "origin"_a, "voxel"_a, "minimum_edge_parameter"_a)
        .def("advance", &Surfacing::advance, "end"_a, "first"_a, "t"_a, "normals"_a)
        .def("finish", &Surfacing::finish);
}

}  // namespace fracslice::mesh
