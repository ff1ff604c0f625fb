// The extension module fracslice._slices. Its Python face and its documentation are in ../../_slices.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "../machine.h"
#include "beams.h"
#include "deflate.h"
#include "picture.h"

namespace nb = nanobind;

namespace fracslice::slices {

void bind_checks(nb::module_& module);

namespace {

// Machine code of a scene, `fracslice.expr.loops.points` on float.
class Compiled : public Field {
 public:
    explicit Compiled(const nb::tuple& entry)
        : machine_(entry),
          points_(machine_.function<const float*, const float*, const float*, const float*, float*, ptrdiff_t>()),
          parameters_(machine_.array(1)) {}
    void values(const float* x, const float* y, const float* z, float* f, size_t n) const override {
        points_(parameters_, x, y, z, f, ptrdiff_t(n));
    }

 private:
    Machine<float> machine_;
    void (*points_)(const float*, const float*, const float*, const float*, float*, ptrdiff_t);
    const float* parameters_;
};

// A Python function of points [3, n] that writes their values to [1, n].
class Called : public Field {
 public:
    explicit Called(nb::object function) : function_(std::move(function)) {}
    void values(const float* x, const float* y, const float* z, float* f, size_t n) const override {
        std::vector<float> points;
        for (const float* row : {x, y, z}) points.insert(points.end(), row, row + n);
        nb::gil_scoped_acquire locked;
        auto view = [n](float* p, size_t rows) {
            return nb::cast(nb::ndarray<nb::numpy, float, nb::ndim<2>>(p, {rows, n}, nb::handle()), nb::rv_policy::reference);
        };
        function_(view(points.data(), 3), view(f, 1));
    }

 private:
    nb::object function_;
};

// A kernel's entry: a tuple of machine code and parameters, or a Python function.
std::shared_ptr<Field> field_of(const nb::object& entry) {
    if (nb::isinstance<nb::tuple>(entry)) return std::make_shared<Compiled>(nb::cast<nb::tuple>(entry));
    return std::make_shared<Called>(entry);
}

template <class T, class Row>
nb::object owned(std::vector<Row>&& rows, std::initializer_list<size_t> shape) {
    auto* kept = new std::vector<Row>(std::move(rows));
    nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<Row>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(reinterpret_cast<T*>(kept->data()), shape, owner));
}

// After so long, a call that makes several pictures returns those that it has: the work may be cancelled.
constexpr std::chrono::milliseconds kUnlocked(20);

using Bytes = nb::ndarray<uint8_t, nb::ndim<2>, nb::device::cpu>;
using Balls = nb::ndarray<const double, nb::shape<-1, 2, 4>, nb::c_contig, nb::device::cpu>;
using Planes = nb::ndarray<const double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;

// What act() returns; other threads of Python run meanwhile.
template <class Do>
auto unlocked(const Do& act) {
    nb::gil_scoped_release released;
    return act();
}

// Layers are read one at a time.
void held(const Slab& slab, int layer) {
    if (layer != slab.layer()) throw nb::value_error("another layer of the slab was sampled since");
}

nb::tuple bind_paint(const Slab& slab, int layer, const Bytes& image) {
    held(slab, layer);
    Canvas canvas{image.data(), int(image.shape(0)), int(image.shape(1)), image.stride(0), image.stride(1)};
    Painted painted = unlocked([&] { return paint(slab, canvas); });
    return nb::make_tuple(painted.area, painted.partly);
}

nb::tuple bind_runs(const Slab& slab, int layer, std::array<int, 2> shape) {
    held(slab, layer);
    SolidRuns result = unlocked([&] { return solid_runs(slab, shape[0], shape[1]); });
    const size_t rows = result.rows.size(), n = result.runs.size();
    return nb::make_tuple(owned<int32_t>(std::move(result.rows), {rows}), owned<int32_t>(std::move(result.runs), {n, 2}),
                          result.painted.area, result.painted.partly);
}

nb::bytes bytes(const Rows<uint8_t>& data) { return nb::bytes(data.data(), data.size()); }

View view_of(std::array<int, 2> rows_columns, bool transposed, bool backwards, std::array<int, 2> at,
             std::array<int, 2> shape, const nb::bytes& levels) {
    View view{rows_columns[0], rows_columns[1], transposed, backwards, at, shape, {}};
    if (levels.size() != view.levels.size()) throw nb::value_error("256 levels were expected");
    std::copy_n(reinterpret_cast<const uint8_t*>(levels.c_str()), view.levels.size(), view.levels.begin());
    return view;
}

nb::tuple bind_picture(const Slab& slab, int layer, std::array<int, 2> rows_columns, bool transposed, bool backwards,
                       std::array<int, 2> at, std::array<int, 2> shape, const nb::bytes& levels, Encoding encoding,
                       const Slabs& others) {
    Slabs slabs{&slab};
    slabs.insert(slabs.end(), others.begin(), others.end());
    for (const Slab* one : slabs) held(*one, layer);
    const View view = view_of(rows_columns, transposed, backwards, at, shape, levels);
    Picture shown = unlocked([&] { return picture(slabs, view, encoding); });
    return nb::make_tuple(bytes(*shown.data), shown.painted.area, shown.painted.partly);
}

nb::list bind_pictures(Slab& slab, const std::vector<int>& layers, std::array<int, 2> rows_columns, bool transposed,
                       bool backwards, std::array<int, 2> at, std::array<int, 2> shape, const nb::bytes& levels,
                       Encoding encoding) {
    struct Made {
        Rows<uint8_t> data;
        Painted painted;
        int64_t evaluations;
    };
    const View view = view_of(rows_columns, transposed, backwards, at, shape, levels);
    std::vector<Made> made;
    unlocked([&] {
        const auto end = std::chrono::steady_clock::now() + kUnlocked;
        for (size_t i = 0; i < layers.size() && (i == 0 || std::chrono::steady_clock::now() < end); ++i) {
            const int64_t before = slab.evaluations();
            slab.sample(layers[i]);
            const Picture shown = picture({&slab}, view, encoding);
            made.push_back({*shown.data, shown.painted, slab.evaluations() - before});
        }
    });
    nb::list result;
    for (const Made& m : made) {
        nb::tuple shown = nb::make_tuple(bytes(m.data), m.painted.area, m.painted.partly);
        result.append(nb::make_tuple(m.evaluations, std::move(shown)));
    }
    return result;
}

// Slabs, layer, transposed, backwards, rows and columns of the layer, upside down, places.
using GivenPiece = std::tuple<Slabs, int, bool, bool, std::array<int, 2>, bool, std::vector<std::array<int, 2>>>;

nb::tuple bind_plate(const std::vector<GivenPiece>& given, std::array<int, 2> rows_columns, const nb::bytes& levels,
                     Encoding encoding) {
    std::vector<Piece> pieces;
    for (const auto& [slabs, layer, transposed, backwards, shape, upside_down, places] : given) {
        for (const Slab* slab : slabs) held(*slab, layer);
        const std::array<int, 2> own = {shape[transposed], shape[!transposed]};
        pieces.push_back({slabs, view_of(own, transposed, backwards, {0, 0}, shape, levels), upside_down, places});
    }
    Picture shown = unlocked([&] { return picture(pieces, rows_columns[0], rows_columns[1], encoding); });
    return nb::make_tuple(bytes(*shown.data), shown.painted.area, shown.painted.partly);
}

nb::bytes bind_encoded(const nb::ndarray<const uint8_t, nb::ndim<2>, nb::device::cpu>& image, Encoding encoding) {
    auto* first = const_cast<uint8_t*>(image.data());
    const Canvas canvas{first, int(image.shape(0)), int(image.shape(1)), image.stride(0), image.stride(1)};
    return bytes(*unlocked([&] { return &encoded(canvas, encoding); }));
}

nb::bytes bind_filtered(const nb::ndarray<const uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>& rows, size_t pixel) {
    if (rows.shape(0) < 1 || pixel < 1) throw nb::value_error("a row above and a pixel of at least a byte were expected");
    const size_t count = rows.shape(0) - 1, width = rows.shape(1);
    Rows<uint8_t> result(count * (width + 1));
    unlocked([&] { filter_rows(rows.data(), count, width, pixel, result.data()); });
    return bytes(result);
}

nb::tuple bind_crossings(const Slab& slab, int layer) {
    held(slab, layer);
    Crossings result = unlocked([&] { return crossings(slab); });
    size_t n = result.edges.size();
    return nb::make_tuple(owned<int32_t>(std::move(result.edges), {n, 4}), owned<double>(std::move(result.ends), {n, 2}));
}

nb::tuple bind_signs(const Slab& slab) {
    const size_t rows = size_t(slab.rows() - 2) * kTile, columns = size_t(slab.columns() - 2) * kTile;
    std::vector<uint8_t> inside(rows * columns), known(inside.size());
    for (size_t r = 0; r < rows; ++r)
        for (size_t c = 0; c < columns; ++c) {
            const int y = int(r / kTile) + 1, x = int(c / kTile) + 1, bit = int(kTile * (r % kTile) + c % kTile);
            inside[r * columns + c] = slab.word(y, x) >> bit & 1;
            known[r * columns + c] = slab.tiles().known[slab.at(y, x)] >> bit & 1;
        }
    return nb::make_tuple(owned<uint8_t>(std::move(inside), {rows, columns}), owned<uint8_t>(std::move(known), {rows, columns}));
}

}  // namespace
}  // namespace fracslice::slices

NB_MODULE(_slices, module) {
    using namespace nanobind::literals;
    using namespace fracslice::slices;
    nb::set_leak_warnings(false);  // the command exits without a search for garbage
    nb::exception<std::domain_error>(module, "BorderError", PyExc_ValueError);
    nb::class_<ProbeBounds>(module, "ProbeBounds")
        .def(nb::init<double, double, double, bool>(), "proven"_a, "outside"_a, "inside"_a, "escape_time_only"_a);
    nb::enum_<Encoding>(module, "Encoding")
        .value("PNG", Encoding::png)
        .value("GOO", Encoding::goo)
        .value("RLE7", Encoding::rle7)
        .value("RLE4", Encoding::rle4)
        .value("RLE1", Encoding::rle1);
    module.def("encoded", &bind_encoded, "image"_a, "encoding"_a);
    module.def("plate_picture", &bind_plate, "pieces"_a, "pixels"_a, "levels"_a, "encoding"_a);
    module.def("filtered", &bind_filtered, "rows"_a, "pixel"_a);
    nb::class_<Memory>(module, "Memory").def(nb::init<>());
    nb::class_<Slab>(module, "Slab")
        .def("sample", &Slab::sample, "layer"_a, nb::call_guard<nb::gil_scoped_release>())
        .def_prop_ro("evaluations", &Slab::evaluations)
        .def("paint", &bind_paint, "layer"_a, "image"_a)
        .def("runs", &bind_runs, "layer"_a, "shape"_a)
        .def("picture", &bind_picture, "layer"_a, "pixels"_a, "transposed"_a, "backwards"_a, "at"_a, "shape"_a, "levels"_a,
             "encoding"_a, "others"_a = Slabs())
        .def("pictures", &bind_pictures, "layers"_a, "pixels"_a, "transposed"_a, "backwards"_a, "at"_a, "shape"_a, "levels"_a,
             "encoding"_a)
        .def("crossings", &bind_crossings, "layer"_a)
        .def("signs", &bind_signs);
    nb::class_<FieldSlab, Slab>(module, "FieldSlab")
        .def("__init__",
             [](FieldSlab* self, std::shared_ptr<Memory> memory, const nb::object& entry, const ProbeBounds& bounds,
                std::array<double, 4> f, std::vector<double> z, int ny, int nx) {
                 const Frame frame{f[0], f[1], f[2], f[3]};
                 new (self) FieldSlab(std::move(memory), field_of(entry), bounds, frame, std::move(z), ny, nx);
             },
             "memory"_a, "entry"_a, "bounds"_a, "frame"_a, "z"_a, "ny"_a, "nx"_a);
    nb::class_<Beams>(module, "Beams")
        .def("__init__",
             [](Beams* self, const Balls& balls, double floor, const Planes& planes) {
                 new (self) Beams({balls.data(), balls.size()}, floor, {planes.data(), planes.size()});
             },
             "balls"_a, "floor"_a, "planes"_a);
    nb::class_<BeamSlab, Slab>(module, "BeamSlab")
        .def("__init__",
             [](BeamSlab* self, std::shared_ptr<Memory> memory, std::shared_ptr<const Beams> beams, std::array<double, 4> f,
                std::vector<double> z, int ny, int nx) {
                 const Frame frame{f[0], f[1], f[2], f[3]};
                 new (self) BeamSlab(std::move(memory), std::move(beams), frame, std::move(z), ny, nx);
             },
             "memory"_a, "beams"_a, "frame"_a, "z"_a, "ny"_a, "nx"_a);
    bind_checks(module);
}
