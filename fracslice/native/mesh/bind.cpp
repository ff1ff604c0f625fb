// Functions of fracslice._native on triangle meshes.
#include <nanobind/stl/optional.h>

#include "../unlocked.h"
#include "crossings.h"
#include "input.h"
#include "links.h"
#include "measures.h"
#include "nesting.h"
#include "predicates.h"
#include "tree.h"
#include "weld.h"

namespace fracslice {
namespace {

using Point = std::array<double, 3>;

void require_labels(const MeshView& mesh, const Vector<int32_t>& labels, size_t parts) {
    if (labels.size() != mesh.count) throw std::invalid_argument("triangles and labels differ in length");
    require_below(labels.data(), labels.size(), parts, "a label names a part that does not exist");
}

nb::tuple bind_links(const Rows<int32_t>& triangles, const Vector<bool>& counted) {
    Links found = unlocked(0, [&] { return links(triangles_of(triangles, counted.size()), counted.data()); });
    return nb::make_tuple(found.edges, found.open, found.crowded, found.misoriented, found.extra_fans);
}

nb::tuple bind_corners(const Rows<int32_t>& triangles, size_t vertices) {
    CornersByVertex found = unlocked(0, [&] { return corners_by_vertex(triangles_of(triangles, vertices)); });
    return nb::make_tuple(to_numpy(std::move(found.start), {vertices + 1}),
                          to_numpy(std::move(found.corner), {triangles.size()}));
}

nb::tuple bind_parts(const Rows<int32_t>& triangles, size_t vertices) {
    Parts found = unlocked(0, [&] { return parts(triangles_of(triangles, vertices)); });
    return nb::make_tuple(to_numpy(std::move(found.labels), {triangles.shape(0)}), found.count);
}

nb::object bind_volumes(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int32_t>& labels,
                        size_t count) {
    Array<double> volumes = unlocked(0, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        require_labels(mesh, labels, count);
        return shell_volumes(mesh, labels.data(), count);
    });
    return to_numpy(std::move(volumes), {count});
}

nb::tuple bind_measures(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Point& point) {
    Measures found = unlocked(0, [&] { return measures(mesh_of(vertices, triangles), point); });
    return nb::make_tuple(found.area, found.volume, found.flat);
}

nb::object numbers(const std::vector<int64_t>& found) {
    Array<int64_t> rows(found.size(), 1);
    std::copy(found.begin(), found.end(), rows.data.get());
    return to_numpy(std::move(rows), {found.size()});
}

nb::object bind_turned(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Rows<double>& points) {
    if (points.shape(0) != vertices.shape(0)) throw nb::value_error("vertices and points differ in length");
    return numbers(unlocked(0, [&] { return turned(mesh_of(vertices, triangles), points.data()); }));
}

nb::object bind_pointed(const Rows<double>& vertices, const Rows<int32_t>& triangles, double sine) {
    return numbers(unlocked(0, [&] { return pointed(mesh_of(vertices, triangles), sine); }));
}

nb::tuple bind_bounds(const Rows<double>& points) {
    if (!points.shape(0)) throw nb::value_error("no points");
    Bounds found = unlocked(0, [&] { return bounds(points.data(), points.shape(0)); });
    return nb::make_tuple(found.low, found.high);
}

nb::tuple bind_weld(const Rows<float>& points) {
    size_t count = points.shape(0);
    Welded found = unlocked(0, [&] { return weld(reinterpret_cast<const uint32_t*>(points.data()), count); });
    size_t sets = found.first.rows;
    return nb::make_tuple(to_numpy(std::move(found.first), {sets}), to_numpy(std::move(found.labels), {count}));
}

nb::tuple bind_tree(const Rows<double>& vertices, const Rows<int32_t>& triangles) {
    Tree tree = unlocked(0, [&] { return build_tree(mesh_of(vertices, triangles)); });
    size_t nodes = tree.low.rows;
    return nb::make_tuple(to_numpy(std::move(tree.order), {triangles.shape(0)}), to_numpy(std::move(tree.low), {nodes, 3}),
                          to_numpy(std::move(tree.high), {nodes, 3}));
}

nb::object bind_crossings(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int64_t>& order,
                          const Rows<double>& low, const Rows<double>& high, int threads,
                          const std::optional<Vector<bool>>& among) {
    Array<bool> marks = unlocked(threads, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        if (among && among->size() != mesh.count) throw std::invalid_argument("triangles and among differ in length");
        return self_intersecting_triangles(mesh, tree_of(mesh, order, low, high), among ? among->data() : nullptr);
    });
    return to_numpy(std::move(marks), {triangles.shape(0)});
}

nb::tuple bind_nesting(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int32_t>& labels,
                       const Vector<double>& sizes, const Vector<int64_t>& first, const Vector<int64_t>& order,
                       const Rows<double>& low, const Rows<double>& high) {
    size_t shells = sizes.size();
    Nesting found = unlocked(0, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        require_labels(mesh, labels, shells);
        if (first.size() != shells) throw std::invalid_argument("sizes and first differ in length");
        require_below(first.data(), shells, mesh.vertices, "first names a vertex that does not exist", int64_t(-1));
        return nesting(mesh, tree_of(mesh, order, low, high), labels.data(), sizes.data(), first.data(), shells);
    });
    return nb::make_tuple(to_numpy(std::move(found.winding), {shells}), to_numpy(std::move(found.parent), {shells}));
}

int bind_side_of_plane(const Point& a, const Point& b, const Point& c, const Point& d) {
    return side_of_plane(a.data(), b.data(), c.data(), d.data());
}

}  // namespace

void bind_mesh(nb::module_& module) {
    using namespace nanobind::literals;
    module.def("edge_topology", &bind_links, "triangles"_a, "counted"_a);
    module.def("corners_by_vertex", &bind_corners, "triangles"_a, "vertices"_a);
    module.def("connected_components", &bind_parts, "triangles"_a, "vertices"_a);
    module.def("shell_volumes", &bind_volumes, "vertices"_a, "triangles"_a, "labels"_a, "count"_a);
    module.def("measures", &bind_measures, "vertices"_a, "triangles"_a, "point"_a);
    module.def("turned", &bind_turned, "vertices"_a, "triangles"_a, "points"_a);
    module.def("pointed", &bind_pointed, "vertices"_a, "triangles"_a, "sine"_a);
    module.def("bounds", &bind_bounds, "points"_a);
    module.def("weld", &bind_weld, "points"_a);
    module.def("tree", &bind_tree, "vertices"_a, "triangles"_a);
    module.def("self_intersecting_triangles", &bind_crossings, "vertices"_a, "triangles"_a, "order"_a, "low"_a, "high"_a,
               "threads"_a = 0, "among"_a = nb::none());
    module.def("nesting", &bind_nesting, "vertices"_a, "triangles"_a, "labels"_a, "sizes"_a, "first"_a, "order"_a,
               "low"_a, "high"_a);
    bind_reduction(module);
    module.def("side_of_line", &side_of_line, "ax"_a, "ay"_a, "bx"_a, "by"_a, "cx"_a, "cy"_a);
    module.def("side_of_plane", &bind_side_of_plane, "a"_a, "b"_a, "c"_a, "d"_a);
}

}  // namespace fracslice
