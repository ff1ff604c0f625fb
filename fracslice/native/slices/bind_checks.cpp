// Functions of fracslice._slices on layers as runs of pixels.
#include "../numpy.h"
#include "layer_runs.h"

#include <cstring>
#include <stdexcept>

namespace fracslice::slices {
namespace {

template <class T>
using Pixels = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Edges = Rows<int64_t, 2>;

std::span<const Edge> edges_of(const Edges& edges) { return {reinterpret_cast<const Edge*>(edges.data()), edges.shape(0)}; }

template <class T>
ImageView<T> image_of(const Pixels<T>& image) {
    return {int(image.shape(0)), int(image.shape(1)), image.data()};
}

void require_nodes(std::span<const int64_t> nodes, size_t count) {
    for (int64_t node : nodes) require(node >= 0 && size_t(node) < count, "a node does not exist");
}

void require_nodes(const Edges& edges, size_t count) { require_nodes({edges.data(), edges.size()}, count); }

template <class T, class From>
nb::object pixels(const Image<From>& image) {
    return to_numpy<T>(image.pixels, {size_t(image.height), size_t(image.width)});
}

// An object of fracslice.slicing.feature_graph.Runs.
class RunsArrays {
  public:
    explicit RunsArrays(const nb::object& runs)
        : rows_(nb::cast<Vector<int32_t>>(runs.attr("rows"))), begin_(nb::cast<Vector<int32_t>>(runs.attr("begin"))),
          end_(nb::cast<Vector<int32_t>>(runs.attr("end"))),
          view{span_of(rows_), span_of(begin_), span_of(end_), nb::cast<int>(runs.attr("width"))} {
        const size_t count = view.begin.size();
        require(!view.rows.empty() && view.rows.front() == 0 && size_t(view.rows.back()) == count, "rows do not hold the runs");
        for (size_t y = 1; y < view.rows.size(); ++y) require(view.rows[y - 1] <= view.rows[y], "rows do not ascend");
        require(view.end.size() == count, "runs differ in number");
        for (size_t r = 0; r < count; ++r) {
            require(view.begin[r] >= 0 && view.begin[r] < view.end[r] && view.end[r] <= view.width, "a run leaves its row");
        }
    }

  private:
    Vector<int32_t> rows_, begin_, end_;

  public:
    LayerRuns view;
};

void require_like(const RunsArrays& one, const RunsArrays& other) {
    require(one.view.height() == other.view.height() && one.view.width == other.view.width, "layers differ in size");
}

nb::tuple arrays(const OwnedRuns& runs) {
    return nb::make_tuple(to_numpy<int32_t>(runs.rows, {runs.rows.size()}), to_numpy<int32_t>(runs.begin, {runs.begin.size()}),
                          to_numpy<int32_t>(runs.end, {runs.end.size()}));
}

nb::tuple bind_gaps(const nb::object& runs) {
    const RunsArrays of(runs);
    return arrays(released([&] { return gaps(of.view); }));
}

nb::tuple bind_components(const nb::object& runs, int reach) {
    const RunsArrays of(runs);
    const RunComponents found = released([&] { return components(of.view, reach); });
    const size_t count = found.area.size();
    return nb::make_tuple(to_numpy<int64_t>(found.label, {found.label.size()}), to_numpy<int64_t>(found.area, {count}),
                          to_numpy<double>(found.middle, {count, 2}), to_numpy<bool>(found.open, {count}));
}

nb::object bind_overlaps(const nb::object& below, const Vector<int64_t>& labels_below, const nb::object& above,
                         const Vector<int64_t>& labels_above) {
    const RunsArrays a(below), b(above);
    require_like(a, b);
    require(labels_below.size() == a.view.begin.size() && labels_above.size() == b.view.begin.size(), "runs and labels differ in number");
    const auto pairs = released([&] { return overlaps(a.view, span_of(labels_below), b.view, span_of(labels_above)); });
    return to_numpy<int64_t>(pairs, {pairs.size(), 2});
}

nb::tuple bind_unsupported(const nb::object& below, const nb::object& above, double reach) {
    const RunsArrays a(below), b(above);
    require_like(a, b);
    return arrays(released([&] { return unsupported(a.view, b.view, reach); }));
}

nb::object bind_count(const nb::object& runs, int times) {
    require(times >= 1, "a coarse pixel has pixels");
    const RunsArrays of(runs);
    return pixels<int32_t>(released([&] { return count_pixels(of.view, times); }));
}

nb::object bind_narrow(const nb::object& runs, bool gaps, int times, const std::array<int64_t, 2>& longest) {
    require(times >= 1, "a coarse pixel has pixels");
    const RunsArrays of(runs);
    return pixels<bool>(released([&] { return narrow_pixels(of.view, gaps, times, longest); }));
}

nb::object bind_painted(const nb::object& runs, std::array<int, 2> at, std::array<int, 2> shape) {
    const RunsArrays of(runs);
    return pixels<bool>(released([&] { return painted(of.view, at[0], at[1], shape[0], shape[1]); }));
}

nb::object bind_distances(const Pixels<bool>& region, std::array<double, 2> pixel) {
    return pixels<double>(released([&] { return distances(image_of(region), pixel[1], pixel[0]); }));
}

nb::object bind_dilated(const Pixels<uint8_t>& image, const Pixels<double>& cone) {
    require(cone.shape(0) == cone.shape(1) && cone.shape(0) % 2 == 1, "a cone is a square of an odd number of pixels");
    return pixels<uint8_t>(released([&] { return dilated(image_of(image), image_of(cone)); }));
}

nb::object bind_closed(const Edges& edges, const Vector<int64_t>& later, const Vector<int64_t>& layer, const Vector<bool>& free) {
    require_nodes(edges, layer.size());
    require(later.size() == edges.shape(0) && free.size() == layer.size(), "arrays differ in length");
    return to_numpy<bool>(released([&] { return closed_nodes(edges_of(edges), span_of(later), span_of(layer), span_of(free)); }),
                         {layer.size()});
}

nb::object bind_held(const Edges& edges, const Vector<int64_t>& roots, size_t count) {
    require_nodes(edges, count);
    require_nodes(span_of(roots), count);
    return to_numpy<bool>(released([&] { return held_nodes(edges_of(edges), span_of(roots), count); }), {count});
}

nb::tuple bind_weakest(const Vector<double>& area, const Vector<double>& firm, const Edges& edges, const Vector<int64_t>& starts,
                       double foot, double least) {
    require(firm.size() == area.size(), "arrays differ in length");
    require_nodes(edges, area.size());
    require_nodes(span_of(starts), edges.shape(0) + 1);
    const WeakestCut cut = released([&] {
        return weakest_cut(span_of(area), span_of(firm), edges_of(edges), span_of(starts), foot, least);
    });
    return nb::make_tuple(cut.contact, cut.carried, cut.cut, cut.node);
}

nb::object bind_spans(const Pixels<bool>& solid, const Pixels<bool>& held, std::array<int, 2> step) {
    require(solid.shape(0) == held.shape(0) && solid.shape(1) == held.shape(1), "pictures differ in size");
    return pixels<float>(released([&] { return spans(image_of(solid), image_of(held), step[0], step[1]); }));
}

nb::object bind_connected(const Pixels<bool>& solid, const Pixels<bool>& held) {
    require(solid.shape(0) == held.shape(0) && solid.shape(1) == held.shape(1), "pictures differ in size");
    return pixels<bool>(released([&] { return connected_to(image_of(solid), image_of(held)); }));
}

}  // namespace

void bind_checks(nb::module_& module) {
    using namespace nanobind::literals;
    module.def("gaps", &bind_gaps, "runs"_a);
    module.def("components", &bind_components, "runs"_a, "reach"_a);
    module.def("overlaps", &bind_overlaps, "below"_a, "labels_below"_a, "above"_a, "labels_above"_a);
    module.def("unsupported", &bind_unsupported, "below"_a, "above"_a, "reach"_a);
    module.def("count_pixels", &bind_count, "runs"_a, "times"_a);
    module.def("narrow_pixels", &bind_narrow, "runs"_a, "gaps"_a, "times"_a, "longest"_a);
    module.def("painted", &bind_painted, "runs"_a, "at"_a, "shape"_a);
    module.def("distances", &bind_distances, "region"_a, "pixel"_a);
    module.def("dilated", &bind_dilated, "image"_a, "cone"_a);
    module.def("closed_nodes", &bind_closed, "edges"_a, "later"_a, "layer"_a, "free"_a);
    module.def("held_nodes", &bind_held, "edges"_a, "roots"_a, "count"_a);
    module.def("weakest_cut", &bind_weakest, "area"_a, "firm"_a, "edges"_a, "starts"_a, "foot"_a, "least"_a);
    module.def("spans", &bind_spans, "solid"_a, "held"_a, "step"_a);
    module.def("connected_to", &bind_connected, "solid"_a, "held"_a);
}

}  // namespace fracslice::slices
