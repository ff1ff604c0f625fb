// Functions of fracslice._native on sampled solids.
#include "../disjoint_sets.h"
#include "../mesh/input.h"
#include "../volume/brick_arrays.h"
#include "forest.h"
#include "sampled_field.h"

#include <cstring>
#include <numeric>
#include <stdexcept>

namespace fracslice::printing {
namespace {

using mesh::require_below;
using volume::IjkArray;
using volume::IndexArray;
using volume::ValuesArray;

using Points = Rows<double>;
template <class T>
using Samples = Rows<T, volume::kSamples>;

template <class Row = Point>
std::span<const Row> rows_of(const Rows<double, std::tuple_size_v<Row>>& rows) {
    return {reinterpret_cast<const Row*>(rows.data()), rows.shape(0)};
}

Rays rays_of(const Points& start, const Points& directions) {
    require(start.shape(0) == directions.shape(0), "starts and directions differ in length");
    return {rows_of(start), rows_of(directions)};
}

// A sampled field, with the arrays that it looks at.
class Bound {
  public:
    Bound(const Point& origin, double voxel, IjkArray ijk, ValuesArray values, IndexArray index)
        : ijk_(std::move(ijk)), values_(std::move(values)), index_(std::move(index)), field_(checked(), origin, voxel) {}

    nb::object values(const Vector<double>& x, const Vector<double>& y, const Vector<double>& z) const {
        return at(x, y, z, [&](const Point& p) { return field_.value(p); });
    }
    nb::object capsule_values(const Vector<double>& x, const Vector<double>& y, const Vector<double>& z, double radius) const {
        return at(x, y, z, [&](const Point& p) { return field_.capsule_value(p, radius); });
    }
    nb::object free(const Points& start, const Points& directions, const Vector<double>& far) const {
        const Rays rays = rays_of(start, directions);
        require(far.size() == rays.start.size(), "starts and distances differ in length");
        return to_numpy<double>(released([&] { return field_.free(rays, span_of(far)); }), {far.size()});
    }
    nb::object through(const Points& start, const Points& directions, double limit, double towards) const {
        const Rays rays = rays_of(start, directions);
        return to_numpy<double>(released([&] { return field_.through(rays, limit, towards); }), {rays.start.size()});
    }
    nb::tuple crossings(const Vector<int64_t>& rows) const {
        require_below(span_of(rows), ijk_.shape(0), "a row is of no brick");
        const Crossings found = released([&] { return field_.crossings(span_of(rows)); });
        return nb::make_tuple(to_numpy<double>(found.points), to_numpy<double>(found.normals),
                              to_numpy<double>(found.area, {found.area.size()}));
    }
    bool may_be_deep(double depth, double lipschitz) const {
        return released([&] { return field_.may_be_deep(depth, lipschitz); });
    }

  private:
    volume::Bricks checked() const {
        const volume::Bricks bricks = volume::view(ijk_, values_, index_);
        released([&] { check(bricks); });
        return bricks;
    }
    template <class Value>
    static nb::object at(const Vector<double>& x, const Vector<double>& y, const Vector<double>& z, const Value& value) {
        require(x.size() == y.size() && y.size() == z.size(), "coordinates differ in length");
        Array<double> out(x.size(), 1);
        released([&] {
            for (size_t n = 0; n < x.size(); ++n) out.data[n] = value({x.data()[n], y.data()[n], z.data()[n]});
        });
        return to_numpy(std::move(out), {x.size()});
    }

    IjkArray ijk_;
    ValuesArray values_;
    IndexArray index_;
    SampledField field_;
};

volume::Layout checked(const IjkArray& ijk, const IndexArray& index, size_t rows) {
    require(ijk.shape(0) == rows, "ijk and values differ in length");
    const volume::Layout layout = volume::layout(ijk, index);
    released([&] { check(layout); });
    return layout;
}

template <class Index, class Value>
nb::tuple components_as(const volume::Layout& layout, const Samples<Value>& values) {
    auto found = released([&] { return solid_components<Index>(layout, values.data()); });
    const size_t elements = found.of.rows, count = found.sizes.size();
    return nb::make_tuple(to_numpy(std::move(found.of), {elements}), to_numpy<int64_t>(found.sizes, {count}),
                          to_numpy<bool>(found.inside, {count}));
}

template <class Value>
nb::tuple bind_components(const IjkArray& ijk, const Samples<Value>& values, const IndexArray& index) {
    const volume::Layout layout = checked(ijk, index, values.shape(0));
    const bool is_small = 1 + values.size() + index.size() < size_t(1) << 31;
    return is_small ? components_as<int32_t>(layout, values) : components_as<int64_t>(layout, values);
}

template <class Value, class Index>
nb::object bind_crossings(const IjkArray& ijk, const Samples<Value>& values, const IndexArray& index,
                          const Samples<Index>& labels, size_t count) {
    const volume::Layout layout = checked(ijk, index, values.shape(0));
    require(labels.shape(0) == values.shape(0), "labels and values differ in length");
    require_below(std::span<const Index>(labels.data(), labels.size()), count, "a label names no component");
    return to_numpy<int64_t>(released([&] { return crossings_by_component(layout, values.data(), labels.data(), count); }), {count});
}

nb::tuple bind_graph(size_t count, const Vector<int64_t>& some, const Vector<int64_t>& others) {
    require(some.size() == others.size(), "the ends of edges differ in number");
    for (const auto& ends : {span_of(some), span_of(others)}) require_below(ends, count, "an edge has an end that is no node");
    Array<int64_t> of(count, 1);
    const int64_t components = released([&] {
        std::span<int64_t> parent(of.data.get(), count);
        std::iota(parent.begin(), parent.end(), 0);
        DisjointSets<int64_t> sets(parent);
        for (size_t e = 0; e < some.size(); ++e) sets.unite(some.data()[e], others.data()[e]);
        return sets.number();
    });
    return nb::make_tuple(to_numpy(std::move(of), {count}), components);
}

nb::object bind_ray_points(const Points& start, const Points& directions, const Vector<int64_t>& which, const Vector<double>& s) {
    const Rays rays = rays_of(start, directions);
    require(which.size() == s.size(), "rays and distances differ in length");
    require_below(span_of(which), rays.start.size(), "a ray does not exist");
    const size_t count = s.size();
    Array<double> points(3, count);
    for (size_t i = 0; i < count; ++i) {
        const size_t ray = size_t(which.data()[i]);
        for (size_t k = 0; k < 3; ++k) points.data[k * count + i] = rays.start[ray][k] + s.data()[i] * rays.directions[ray][k];
    }
    return to_numpy(std::move(points), {3, count});
}

nb::object bind_least(const ValuesArray& some, const Vector<int64_t>& rows, const ValuesArray& more, const Vector<int64_t>& others) {
    require(rows.size() == others.size(), "rows differ in number");
    Array<float> least(rows.size(), volume::kSamples);
    for (size_t n = 0; n < rows.size(); ++n) {
        const int64_t a = rows.data()[n], b = others.data()[n];
        require(a < int64_t(some.shape(0)) && b < int64_t(more.shape(0)) && (a >= 0 || b >= 0), "a row is of no brick");
        const float* f = a < 0 ? nullptr : some.data() + size_t(a) * volume::kSamples;
        const float* g = b < 0 ? nullptr : more.data() + size_t(b) * volume::kSamples;
        float* to = &least.data[n * volume::kSamples];
        for (size_t s = 0; s < volume::kSamples; ++s) to[s] = !f ? g[s] : !g ? f[s] : std::min(f[s], g[s]);
    }
    return to_numpy(std::move(least), {rows.size(), volume::kSamples});
}

nb::object bind_near(const Points& points, double reach, const std::array<int, 3>& shape) {
    for (const auto& point : rows_of(points)) {
        for (size_t k = 0; k < 3; ++k) {
            require(point[k] >= reach && point[k] + reach < 8.0 * shape[k], "a point is too near to the border");
        }
    }
    return to_numpy<bool>(released([&] { return bricks_near(rows_of(points), reach, shape); }),
                         {size_t(shape[0]), size_t(shape[1]), size_t(shape[2])});
}

using Lines = Rows<double, 7>;

nb::object bind_squares(const Lines& lines, const Points& points, const Vector<int32_t>& of, double reach, const IjkArray& ijk,
                        const IndexArray& index) {
    require(points.shape(0) == of.size(), "points and axes differ in number");
    require_below(span_of(of), lines.shape(0), "an axis does not exist");
    const volume::Layout layout = checked(ijk, index, ijk.shape(0));
    Array<float> squares(layout.count, volume::kSamples);
    std::fill_n(squares.data.get(), layout.count * volume::kSamples, float(reach * reach));
    released([&] { lower_squares(rows_of<Line>(lines), rows_of(points), span_of(of), reach, layout, squares.data.get()); });
    return to_numpy(std::move(squares), {layout.count, volume::kSamples});
}

nb::object bind_steps(const IjkArray& ijk, const IndexArray& index, const Samples<bool>& seeds) {
    const volume::Layout layout = checked(ijk, index, seeds.shape(0));
    return to_numpy<uint8_t>(released([&] { return steps_to(layout, seeds.data()); }), {layout.count, volume::kSamples});
}

template <class T>
using Cells = nb::ndarray<const T, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

nb::tuple bind_forest(const Cells<uint8_t>& away, const Cells<float>& cost, const Point& origin, const Point& cell, double floor,
                      const std::array<int, 2>& steps, const std::array<double, 3>& lengths, size_t tries, const Points& ends) {
    for (size_t k = 0; k < 3; ++k) require(away.shape(k) == cost.shape(k) && away.shape(k) > 0, "cells differ in number");
    const std::array<int64_t, 3> shape{int64_t(away.shape(0)), int64_t(away.shape(1)), int64_t(away.shape(2))};
    const Room room{away.data(), cost.data(), shape, origin, cell, floor};
    const auto [wide, narrow] = steps;
    const auto [farthest, lowest, foot] = lengths;
    const auto given = rows_of(ends);
    const Grown made = released(
        [&] { return grow_forest(room, {wide, narrow, farthest, lowest, foot, tries}, {given.begin(), given.end()}); });
    return nb::make_tuple(to_numpy<double>(made.places), to_numpy<int64_t>(made.down, {made.down.size()}),
                          to_numpy<int64_t>(made.trunks, {made.trunks.size()}), to_numpy<int64_t>(made.on, {made.on.size()}));
}

}  // namespace

void bind_printing(nb::module_& module) {
    using namespace nanobind::literals;
    nb::class_<Bound>(module, "SampledField")
        .def(nb::init<const Point&, double, IjkArray, ValuesArray, IndexArray>(), "origin"_a, "voxel"_a, "ijk"_a, "values"_a, "index"_a)
        .def("values", &Bound::values, "x"_a, "y"_a, "z"_a)
        .def("capsule_values", &Bound::capsule_values, "x"_a, "y"_a, "z"_a, "radius"_a)
        .def("free", &Bound::free, "start"_a, "directions"_a, "far"_a)
        .def("through", &Bound::through, "start"_a, "directions"_a, "limit"_a, "towards"_a)
        .def("crossings", &Bound::crossings, "rows"_a)
        .def("may_be_deep", &Bound::may_be_deep, "depth"_a, "lipschitz"_a);
    module.def("solid_components", &bind_components<float>, "ijk"_a, "values"_a.noconvert(), "index"_a);
    module.def("solid_components", &bind_components<int8_t>, "ijk"_a, "values"_a.noconvert(), "index"_a);
    module.def("crossings_by_component", &bind_crossings<float, int32_t>, "ijk"_a, "values"_a.noconvert(), "index"_a,
               "labels"_a.noconvert(), "count"_a);
    module.def("crossings_by_component", &bind_crossings<int8_t, int32_t>, "ijk"_a, "values"_a.noconvert(), "index"_a,
               "labels"_a.noconvert(), "count"_a);
    module.def("crossings_by_component", &bind_crossings<float, int64_t>, "ijk"_a, "values"_a.noconvert(), "index"_a,
               "labels"_a.noconvert(), "count"_a);
    module.def("crossings_by_component", &bind_crossings<int8_t, int64_t>, "ijk"_a, "values"_a.noconvert(), "index"_a,
               "labels"_a.noconvert(), "count"_a);
    module.def("graph_components", &bind_graph, "count"_a, "some"_a, "others"_a);
    module.def("ray_points", &bind_ray_points, "start"_a, "directions"_a, "which"_a, "s"_a);
    module.def("least", &bind_least, "some"_a, "rows"_a, "more"_a, "others"_a);
    module.def("bricks_near", &bind_near, "points"_a, "reach"_a, "shape"_a);
    module.def("capsule_squares", &bind_squares, "lines"_a, "points"_a, "of"_a, "reach"_a, "ijk"_a, "index"_a);
    module.def("grow_forest", &bind_forest, "away"_a, "cost"_a, "origin"_a, "cell"_a, "floor"_a, "steps"_a, "lengths"_a, "tries"_a,
               "ends"_a);
    module.def("steps_to", &bind_steps, "ijk"_a, "index"_a, "seeds"_a);
}

}  // namespace fracslice::printing
