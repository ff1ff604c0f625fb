// Functions of fracslice._native on triangle meshes.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <tbb/parallel_for.h>

#include "../unlocked.h"
#include "components.h"
#include "disks.h"
#include "topology.h"
#include "input.h"
#include "quantise.h"
#include "predicates.h"
#include "export.h"
#include "tree.h"

namespace fracslice::mesh {
namespace {

using Point = std::array<double, 3>;

void require_labels(const MeshView& mesh, const Vector<int32_t>& labels, size_t components) {
    if (labels.size() != mesh.vertices) throw std::invalid_argument("vertices and labels differ in length");
    require_below(span_of(labels), components, "a label names a component that does not exist", -1);
    if (!counted(mesh.vertices, [&](size_t v) { return labels.data()[v] < 0; }).back()) return;
    std::atomic<bool> unknown = false;
    for_each_number(mesh.count, [&](size_t t) {
        if (labels.data()[mesh[t][0]] < 0) unknown.store(true, std::memory_order_relaxed);
    });
    if (unknown) throw std::invalid_argument("a triangle has no label");
}

using FrameTuple = std::tuple<double, Point, double>;

Frame frame_of(const FrameTuple& frame) { return {std::get<0>(frame), std::get<1>(frame), std::get<2>(frame)}; }

std::span<const bool> marks_of(const Vector<bool>& marks, size_t count) {
    if (marks.size() != count) throw std::invalid_argument("marks differ in length from what they mark");
    return span_of(marks);
}

nb::tuple bind_links(const Rows<int32_t>& triangles, const Vector<bool>& counted, int threads) {
    EdgeCounts result = unlocked(threads, [&] { return edge_counts(triangles_of(triangles, counted.size()), counted.data()); });
    return nb::make_tuple(result.edges, result.open, result.non_manifold, result.misoriented, result.extra_fans);
}

using DiskAndFan = std::tuple<std::vector<int64_t>, std::vector<std::array<int32_t, 3>>>;

// Of each vertex of `apexes` its disk and fan, or None.
std::vector<std::optional<DiskAndFan>> bind_fans(
    const Rows<int32_t>& triangles, const Rows<int64_t>& beyond, const Rows<double>& vertices, const Rows<double>& normals,
    const Rows<double>& alike, const Vector<bool>& fixed, const Vector<int32_t>& apexes, double thin, double sharp, size_t most,
    int threads) {
    const size_t count = triangles.shape(0);
    require(beyond.shape(0) == count && normals.shape(0) == count && alike.shape(0) == count, "expected a row for each triangle");
    require_below(span_of(triangles), vertices.shape(0), "a triangle names a vertex that does not exist");
    require_below(span_of(beyond), count, "a side names a triangle that does not exist", -1);
    require_below(span_of(apexes), vertices.shape(0), "an apex does not exist");
    auto rows = [](const auto& array, auto row) {
        using Row = decltype(row);
        return std::span<const Row>{reinterpret_cast<const Row*>(array.data()), array.shape(0)};
    };
    using Vector3 = Disks::Vector3;
    std::vector<std::optional<Disk>> found(apexes.size());
    unlocked(threads, [&] {
        const Disks disks(rows(triangles, Disks::Corners{}), rows(beyond, Disks::Sides{}), rows(vertices, Vector3{}),
                          rows(normals, Vector3{}), rows(alike, Vector3{}), marks_of(fixed, vertices.shape(0)), {thin, sharp, most});
        tbb::parallel_for(size_t(0), found.size(), [&](size_t k) { found[k] = disks.grown(apexes.data()[k]); });
    });
    std::vector<std::optional<DiskAndFan>> result(found.size());
    for (size_t k = 0; k < found.size(); ++k) {
        if (found[k]) result[k].emplace(std::move(found[k]->triangles), std::move(found[k]->fan));
    }
    return result;
}

nb::tuple bind_corners(const Rows<int32_t>& triangles, size_t vertices, int threads) {
    CornersByVertex result = unlocked(threads, [&] { return corners_by_vertex(triangles_of(triangles, vertices)); });
    return nb::make_tuple(to_numpy(std::move(result.start), {vertices + 1}),
                          to_numpy(std::move(result.corner), {triangles.size()}));
}

nb::tuple bind_components(const Rows<int32_t>& triangles, size_t vertices, int threads) {
    Components result = unlocked(threads, [&] { return connected_components(triangles_of(triangles, vertices)); });
    return nb::make_tuple(to_numpy(std::move(result.labels), {vertices}), result.count);
}

nb::tuple bind_sizes(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int32_t>& labels, size_t count,
                     int threads) {
    Sizes result = unlocked(threads, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        require_labels(mesh, labels, count);
        return component_sizes(mesh, span_of(labels), count);
    });
    return nb::make_tuple(to_numpy(std::move(result.volumes), {count}), to_numpy(std::move(result.areas), {count}),
                          to_numpy(std::move(result.vectors), {count, 3}), to_numpy(std::move(result.outermost), {count, 6}),
                          to_numpy(std::move(result.flat), {count}));
}

nb::object numbers(const std::vector<int64_t>& result) {
    Array<int64_t> rows(result.size(), 1);
    std::copy(result.begin(), result.end(), rows.data.get());
    return to_numpy(std::move(rows), {result.size()});
}

nb::object bind_turned(const Rows<double>& vertices, const Rows<int32_t>& triangles, const FrameTuple& frame, int threads) {
    return numbers(unlocked(threads, [&] { return turned(mesh_of(vertices, triangles), frame_of(frame)); }));
}

nb::object bind_pointed(const Rows<double>& vertices, const Rows<int32_t>& triangles, double sine, size_t most, int threads) {
    return numbers(unlocked(threads, [&] { return pointed(mesh_of(vertices, triangles), sine, most); }));
}

nb::tuple bind_bounds(const Rows<double>& points, int threads) {
    if (!points.shape(0)) throw nb::value_error("no points");
    Bounds result = unlocked(threads, [&] { return bounds(span_of(points)); });
    return nb::make_tuple(result.low, result.high);
}

nb::tuple bind_quantise(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<bool>& keep,
                        const Vector<bool>& displaced, const Vector<int64_t>& rows, const Rows<int32_t>& corners,
                        const Rows<double>& planes, const FrameTuple& frame, int threads) {
    Quantised result = unlocked(threads, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        if (rows.size() != corners.shape(0)) throw std::invalid_argument("rows and corners differ in length");
        require_below(span_of(rows), mesh.count, "an edit names a triangle that does not exist");
        require_below(span_of(corners), mesh.vertices, "an edit names a vertex that does not exist", -1);
        Edits edits{span_of(rows), corners.data()};
        return quantise(mesh, marks_of(keep, mesh.vertices), marks_of(displaced, mesh.vertices), edits,
                        {planes.data(), planes.shape(0)}, frame_of(frame));
    });
    if (!result.finite) throw nb::value_error("the mesh has a coordinate that is not a finite number");
    size_t n = result.points.rows, m = result.triangles.rows;
    return nb::make_tuple(to_numpy(std::move(result.points), {n, 3}), to_numpy(std::move(result.triangles), {m, 3}),
                          to_numpy(std::move(result.displaced), {n}), numbers(result.places));
}

nb::object bind_selected(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<bool>& keep, int threads) {
    Selection result = unlocked(threads, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        return selected(mesh, marks_of(keep, mesh.count));
    });
    size_t n = result.vertices.rows, m = result.triangles.rows;
    if (n == vertices.shape(0) && m == triangles.shape(0)) return nb::none();
    return nb::make_tuple(to_numpy(std::move(result.vertices), {n, 3}), to_numpy(std::move(result.triangles), {m, 3}));
}

nb::tuple bind_in_order(const Rows<int32_t>& triangles, size_t vertices) {
    Ordered result = unlocked(0, [&] { return in_order(triangles_of(triangles, vertices)); });
    size_t n = result.first.rows;
    return nb::make_tuple(to_numpy(std::move(result.first), {n}), to_numpy(std::move(result.triangles), {triangles.shape(0), 3}));
}

nb::object bind_touching(const Rows<int32_t>& triangles, const Vector<bool>& vertices, int threads) {
    return numbers(unlocked(threads, [&] { return touching(triangles_of(triangles, vertices.size()), span_of(vertices)); }));
}

nb::object bind_near(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Rows<double>& points, double reach, int threads) {
    return numbers(unlocked(threads, [&] { return near(mesh_of(vertices, triangles), span_of(points), reach); }));
}

nb::object bind_near_bodies(const Rows<double>& points, const Vector<int32_t>& labels, const Vector<int32_t>& bodies, size_t count,
                            int32_t largest, const Point& origin, double edge, int threads) {
    return numbers(unlocked(threads, [&] {
        if (labels.size() != points.shape(0)) throw std::invalid_argument("points and labels differ in length");
        require_below(span_of(labels), bodies.size(), "a label names no body");
        require_below(span_of(bodies), count, "a body does not exist", -1);
        LabelledPoints all{points.data(), span_of(labels), span_of(bodies)};
        return near_bodies(all, count, largest, {origin, edge});
    }));
}

nb::object bind_surroundings(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<bool>& of, int threads) {
    return numbers(unlocked(threads, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        return surroundings(mesh, marks_of(of, mesh.count));
    }));
}

template <class Number>
nb::bytes bind_text_rows(const std::vector<std::string>& before, const std::string& end,
                         const nb::ndarray<const Number, nb::ndim<2>, nb::c_contig, nb::device::cpu>& values) {
    if (before.empty() || values.shape(1) != before.size()) throw nb::value_error("expected a text for each column");
    std::string text;
    {
        nb::gil_scoped_release released;
        text = text_rows<Number>(span_of(values), before, end);
    }
    return nb::bytes(text.data(), text.size());
}

nb::object bind_stl(const Rows<double>& vertices, const Rows<int32_t>& triangles, int threads) {
    size_t count = triangles.shape(0);
    Array<uint8_t> bytes(count, kStlBytes);
    unlocked(threads, [&] { write_stl(mesh_of(vertices, triangles), bytes.data.get()); });
    return to_numpy(std::move(bytes), {count, kStlBytes});
}

nb::tuple bind_weld(const Rows<float>& points) {
    size_t count = points.shape(0);
    Welded result = unlocked(1, [&] { return weld({reinterpret_cast<const uint32_t*>(points.data()), 3 * count}); });
    size_t sets = result.first.rows;
    return nb::make_tuple(to_numpy(std::move(result.first), {sets}), to_numpy(std::move(result.labels), {count}));
}

nb::tuple bind_tree(const Rows<double>& vertices, const Rows<int32_t>& triangles, int threads, bool halved) {
    Tree tree = unlocked(threads, [&] { return build_tree(mesh_of(vertices, triangles), halved); });
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

nb::object bind_thin_walls(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int64_t>& order,
                           const Rows<double>& low, const Rows<double>& high, size_t count, double limit, int threads) {
    return to_numpy<double>(unlocked(threads, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        if (count > mesh.count || !(limit > 0)) throw std::invalid_argument("expected at most all triangles, and a limit above zero");
        return thin_walls(mesh, tree_of(mesh, order, low, high), count, limit);
    }));
}

nb::tuple bind_nesting(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int32_t>& labels,
                       const Vector<double>& sizes, const Vector<int64_t>& first, int threads) {
    size_t shells = sizes.size();
    Nesting result = unlocked(threads, [&] {
        MeshView mesh = mesh_of(vertices, triangles);
        require_labels(mesh, labels, shells);
        if (first.size() != shells) throw std::invalid_argument("sizes and first differ in length");
        require_below(span_of(first), mesh.vertices, "first names a vertex that does not exist", -1);
        return nesting(mesh, span_of(labels), span_of(sizes), span_of(first));
    });
    return nb::make_tuple(to_numpy(std::move(result.winding), {shells}), to_numpy(std::move(result.parent), {shells}));
}

nb::object bind_foremost(const Rows<double>& vertices, const Rows<int32_t>& triangles, std::array<int, 2> shape) {
    const std::vector<int32_t> front = unlocked(1, [&] { return foremost(mesh_of(vertices, triangles), shape[0], shape[1]); });
    Array<int32_t> pixels(front.size(), 1);
    std::copy(front.begin(), front.end(), pixels.data.get());
    return to_numpy(std::move(pixels), {size_t(shape[0]), size_t(shape[1])});
}

int bind_side_of_plane(const Point& a, const Point& b, const Point& c, const Point& d) {
    return side_of_plane(a.data(), b.data(), c.data(), d.data());
}

}  // namespace

void bind_mesh(nb::module_& module) {
    using namespace nanobind::literals;
    module.def("edge_topology", &bind_links, "triangles"_a, "counted"_a, "threads"_a = 0);
    module.def("corners_by_vertex", &bind_corners, "triangles"_a, "vertices"_a, "threads"_a = 0);
    module.def("fans", &bind_fans, "triangles"_a, "beyond"_a, "vertices"_a, "normals"_a, "alike"_a, "fixed"_a, "apexes"_a, "thin"_a,
               "sharp"_a, "most"_a, "threads"_a = 0);
    module.def("connected_components", &bind_components, "triangles"_a, "vertices"_a, "threads"_a = 0);
    module.def("component_sizes", &bind_sizes, "vertices"_a, "triangles"_a, "labels"_a, "count"_a, "threads"_a = 0);
    module.def("turned", &bind_turned, "vertices"_a, "triangles"_a, "frame"_a, "threads"_a = 0);
    module.def("pointed", &bind_pointed, "vertices"_a, "triangles"_a, "sine"_a, "most"_a, "threads"_a = 0);
    module.def("bounds", &bind_bounds, "points"_a, "threads"_a = 0);
    module.def("quantise", &bind_quantise, "vertices"_a, "triangles"_a, "keep"_a, "displaced"_a, "rows"_a, "corners"_a, "planes"_a,
               "frame"_a, "threads"_a = 0);
    module.def("selected", &bind_selected, "vertices"_a, "triangles"_a, "keep"_a, "threads"_a = 0);
    module.def("in_order", &bind_in_order, "triangles"_a, "vertices"_a);
    module.def("touching", &bind_touching, "triangles"_a, "vertices"_a, "threads"_a = 0);
    module.def("near", &bind_near, "vertices"_a, "triangles"_a, "points"_a, "reach"_a, "threads"_a = 0);
    module.def("near_bodies", &bind_near_bodies, "points"_a, "labels"_a, "bodies"_a, "count"_a, "largest"_a, "origin"_a, "edge"_a,
               "threads"_a = 0);
    module.def("surroundings", &bind_surroundings, "vertices"_a, "triangles"_a, "of"_a, "threads"_a = 0);
    module.def("text_rows", &bind_text_rows<float>, "before"_a, "end"_a, "values"_a);
    module.def("text_rows", &bind_text_rows<int64_t>, "before"_a, "end"_a, "values"_a);
    module.def("stl", &bind_stl, "vertices"_a, "triangles"_a, "threads"_a = 0);
    module.def("weld", &bind_weld, "points"_a);
    module.def("tree", &bind_tree, "vertices"_a, "triangles"_a, "threads"_a = 0, "halved"_a = false);
    module.def("self_intersecting_triangles", &bind_crossings, "vertices"_a, "triangles"_a, "order"_a, "low"_a, "high"_a,
               "threads"_a = 0, "among"_a = nb::none());
    module.def("thin_walls", &bind_thin_walls, "vertices"_a, "triangles"_a, "order"_a, "low"_a, "high"_a, "count"_a, "limit"_a,
               "threads"_a = 0);
    module.def("nesting", &bind_nesting, "vertices"_a, "triangles"_a, "labels"_a, "sizes"_a, "first"_a, "threads"_a = 0);
    module.def("foremost", &bind_foremost, "vertices"_a, "triangles"_a, "shape"_a);
    module.def("side_of_line", &side_of_line, "ax"_a, "ay"_a, "bx"_a, "by"_a, "cx"_a, "cy"_a);
    module.def("side_of_plane", &bind_side_of_plane, "a"_a, "b"_a, "c"_a, "d"_a);
}

}  // namespace fracslice::mesh
