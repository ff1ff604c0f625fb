// Fewer triangles, how far they are, a mesh as a field, outlines, reliefs and beams: classes of fracslice._native that keep the arrays they look into.
#include "../unlocked.h"
#include "beams.h"
#include "input.h"
#include "outline.h"
#include "reduction.h"
#include "relief.h"
#include "solid.h"

namespace fracslice::mesh {
namespace {

class BoundReduction {
  public:
    BoundReduction(const Rows<double>& vertices, const Rows<int32_t>& triangles, double tolerance)
        : vertices_(vertices), triangles_(triangles),
          reduction_(unlocked(0, [&] { return Reduction(mesh_of(vertices, triangles), tolerance); })) {}

    void renew() { reduction_.renew(); }

    size_t sweep(size_t first, size_t last, double share) {
        if (last > vertices_.shape(0)) throw nb::value_error("no such vertices");
        return unlocked(0, [&] { return reduction_.sweep(first, last, share); });
    }

    void undo(const Vector<bool>& faulty) {
        if (faulty.size() != triangles_.shape(0)) throw nb::value_error("triangles and faults differ in length");
        unlocked(0, [&] { reduction_.undo(faulty.data()); });
    }

    nb::tuple state() {
        auto state = unlocked(0, [&] { return reduction_.state(); });
        size_t count = triangles_.shape(0);
        return nb::make_tuple(to_numpy(std::move(state.triangles), {count, 3}), to_numpy(std::move(state.gone), {count}),
                              to_numpy(std::move(state.step), {count}), to_numpy(std::move(state.fresh), {count}),
                              to_numpy(std::move(state.owner), {vertices_.shape(0)}));
    }

  private:
    Rows<double> vertices_;
    Rows<int32_t> triangles_;
    Reduction reduction_;
};

// A mesh and its tree: the arrays that searches look into.
struct BoundMesh {
    Rows<double> vertices;
    Rows<int32_t> triangles;
    Vector<int64_t> order;
    Rows<double> low, high;

    // What make(mesh, tree) returns, on all threads. empty: the error about a mesh without triangles.
    template <class Make>
    auto made(const char* empty, const Make& make) const {
        return unlocked(0, [&] {
            const MeshView mesh = mesh_of(vertices, triangles);
            require(mesh.count > 0, empty);
            return make(mesh, tree_of(mesh, order, low, high));
        });
    }
};

class BoundNearest {
  public:
    BoundNearest(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int64_t>& order,
                 const Rows<double>& low, const Rows<double>& high, bool closed)
        : mesh_{vertices, triangles, order, low, high},
          nearest_(mesh_.made("nothing is near an empty mesh",
                              [&](const MeshView& mesh, const TreeView& tree) { return Nearest(mesh, tree, closed); })) {}

    nb::tuple bounds(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Rows<int32_t>& hints, double tolerance,
                     int threads) const {
        size_t count = triangles.shape(0);
        Array<double> distances(count, 1);
        auto beyond = unlocked(threads, [&] {
            MeshView mesh = mesh_of(vertices, triangles);
            if (hints.shape(0) > 0 && hints.shape(0) != mesh.count) throw std::invalid_argument("triangles and hints differ in length");
            require_below(span_of(hints), mesh_.triangles.shape(0), "a hint names a triangle that does not exist");
            return nearest_.bounds(mesh, span_of(hints), tolerance, distances.data.get());
        });
        return nb::make_tuple(to_numpy(std::move(distances), {count}), to_numpy<int32_t>(beyond));
    }

    nb::object points(const Rows<double>& points, int threads) const {
        Array<double> distances(points.shape(0), 1);
        unlocked(threads, [&] { nearest_.points(span_of(points), distances.data.get()); });
        return to_numpy(std::move(distances), {points.shape(0)});
    }

    nb::object samples(const Rows<double>& vertices, const Rows<int32_t>& triangles, double spacing, double enough,
                       int threads) const {
        Array<double> distances(triangles.shape(0), 1);
        unlocked(threads, [&] { nearest_.samples(mesh_of(vertices, triangles), spacing, enough, distances.data.get()); });
        return to_numpy(std::move(distances), {triangles.shape(0)});
    }

  private:
    BoundMesh mesh_;
    Nearest nearest_;
};

using Strided = nb::ndarray<const double, nb::ndim<1>, nb::device::cpu>;

class BoundMeshField {
  public:
    BoundMeshField(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int64_t>& order,
                   const Rows<double>& low, const Rows<double>& high)
        : mesh_{vertices, triangles, order, low, high},
          field_(mesh_.made("an empty mesh is no field",
                            [](const MeshView& mesh, const TreeView& tree) { return MeshField(mesh, tree); })) {}

    // Calls come from many threads: each takes one.
    nb::object points(const Strided& x, const Strided& y, const Strided& z) const {
        const size_t count = x.shape(0);
        if (y.shape(0) != count || z.shape(0) != count) throw std::invalid_argument("coordinates differ in length");
        Array<double> points(count, 3), values(count, 1);
        {
            nb::gil_scoped_release released;
            size_t k = 0;
            for (const Strided* row : {&x, &y, &z}) {
                const double* from = row->data();
                for (size_t i = 0; i < count; ++i) points.data[3 * i + k] = from[ptrdiff_t(i) * row->stride(0)];
                ++k;
            }
            field_.points({points.data.get(), 3 * count}, values.data.get());
        }
        return to_numpy(std::move(values), {count});
    }
    nb::object bricks(const Rows<int32_t>& corners, const std::array<double, 3>& origin, double voxel) const {
        Array<float> values(corners.shape(0), 512);
        {
            nb::gil_scoped_release released;
            field_.bricks(span_of(corners), origin, voxel, values.data.get());
        }
        return to_numpy(std::move(values), {corners.shape(0), 512});
    }

  private:
    BoundMesh mesh_;
    MeshField field_;
};

// Distances of points, one a row.
template <class Shape>
nb::object distances_of(const Shape& shape, const Rows<double, Shape::kAxes>& points) {
    Array<double> values(points.shape(0), 1);
    {
        nb::gil_scoped_release released;
        size_t guess = 0;
        for (size_t i = 0; i < points.shape(0); ++i) values.data[i] = shape(points.data() + Shape::kAxes * i, guess);
    }
    return to_numpy(std::move(values), {points.shape(0)});
}

class BoundSolid {
  public:
    BoundSolid(const Rows<double>& vertices, const Rows<int32_t>& triangles, const Vector<int64_t>& order, const Rows<double>& low,
               const Rows<double>& high)
        : mesh_{vertices, triangles, order, low, high} {
        mesh_.made("an empty mesh is no solid", [&](const MeshView& mesh, const TreeView& tree) { solid_.emplace(mesh, tree); });
    }

    uintptr_t address() const { return reinterpret_cast<uintptr_t>(solid_->entry()); }

    nb::object distances(const Rows<double>& points) const { return distances_of(*solid_, points); }
    const Solid* solid() const { return &*solid_; }

  private:
    BoundMesh mesh_;
    std::optional<Solid> solid_;
};

class BoundSolids {
  public:
    explicit BoundSolids(const nb::list& solids) : kept_(solids), solids_(of(solids)) {}

    uintptr_t address() const { return reinterpret_cast<uintptr_t>(solids_.entry()); }
    nb::object distances(const Rows<double>& points) const { return distances_of(solids_, points); }

  private:
    static std::vector<const Solid*> of(const nb::list& solids) {
        std::vector<const Solid*> found;
        for (nb::handle solid : solids) found.push_back(nb::cast<const BoundSolid&>(solid).solid());
        require(!found.empty(), "expected at least one solid");
        return found;
    }

    nb::tuple kept_;
    Solids solids_;
};

class BoundBeams {
  public:
    using Balls = nb::ndarray<const double, nb::shape<-1, 2, 4>, nb::c_contig, nb::device::cpu>;

    BoundBeams(const Balls& balls, const Vector<int32_t>& chains, double seam)
        : beams_((require(balls.size() > 0 && balls.shape(0) == chains.size(), "expected at least one beam, each of a chain"), span_of(balls)),
                 span_of(chains), seam) {}

    uintptr_t address() const { return reinterpret_cast<uintptr_t>(beams_.entry()); }
    nb::object distances(const Rows<double>& points) const { return distances_of(beams_, points); }

  private:
    Beams beams_;
};

class BoundOutline {
  public:
    BoundOutline(const Rows<double, 2>& corners, const Vector<int64_t>& ends)
        : outline_(span_of(corners), (require_rings(span_of(ends), corners.shape(0)), span_of(ends))) {}

    uintptr_t address() const { return reinterpret_cast<uintptr_t>(outline_.entry()); }
    nb::object distances(const Rows<double, 2>& points) const { return distances_of(outline_, points); }

  private:
    static void require_rings(std::span<const int64_t> ends, size_t count) {
        int64_t begin = 0;
        for (int64_t end : ends) {
            if (end < begin + 3) throw std::invalid_argument("a ring has at least three corners");
            begin = end;
        }
        if (ends.empty() || size_t(begin) != count) throw std::invalid_argument("rings and corners differ in length");
    }

    Outline outline_;
};

class BoundRelief {
  public:
    using Grid = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

    BoundRelief(const Grid& heights, double across, double up, bool wraps)
        : relief_((require(heights.size() > 0, "a relief has heights"), span_of(heights)), heights.shape(1), across, up, wraps) {}

    uintptr_t address() const { return reinterpret_cast<uintptr_t>(relief_.entry()); }
    nb::object distances(const Rows<double, 2>& points) const { return distances_of(relief_, points); }

  private:
    Relief relief_;
};

}  // namespace

void bind_reduction(nb::module_& module) {
    using namespace nanobind::literals;
    nb::class_<BoundReduction>(module, "Reduction")
        .def(nb::init<const Rows<double>&, const Rows<int32_t>&, double>(), "vertices"_a, "triangles"_a, "tolerance"_a)
        .def("renew", &BoundReduction::renew)
        .def("sweep", &BoundReduction::sweep, "first"_a, "last"_a, "share"_a)
        .def("undo", &BoundReduction::undo, "faulty"_a)
        .def("state", &BoundReduction::state);
    nb::class_<BoundNearest>(module, "Nearest")
        .def(nb::init<const Rows<double>&, const Rows<int32_t>&, const Vector<int64_t>&, const Rows<double>&, const Rows<double>&,
                      bool>(),
             "vertices"_a, "triangles"_a, "order"_a, "low"_a, "high"_a, "closed"_a = false)
        .def("bounds", &BoundNearest::bounds, "vertices"_a, "triangles"_a, "hints"_a, "tolerance"_a, "threads"_a = 0)
        .def("points", &BoundNearest::points, "points"_a, "threads"_a = 0)
        .def("samples", &BoundNearest::samples, "vertices"_a, "triangles"_a, "spacing"_a, "enough"_a, "threads"_a = 0);
    nb::class_<BoundMeshField>(module, "MeshField")
        .def(nb::init<const Rows<double>&, const Rows<int32_t>&, const Vector<int64_t>&, const Rows<double>&, const Rows<double>&>(),
             "vertices"_a, "triangles"_a, "order"_a, "low"_a, "high"_a)
        .def("points", &BoundMeshField::points, "x"_a, "y"_a, "z"_a)
        .def("bricks", &BoundMeshField::bricks, "corners"_a, "origin"_a, "voxel"_a);
    nb::class_<BoundSolid>(module, "Solid")
        .def(nb::init<const Rows<double>&, const Rows<int32_t>&, const Vector<int64_t>&, const Rows<double>&, const Rows<double>&>(),
             "vertices"_a, "triangles"_a, "order"_a, "low"_a, "high"_a)
        .def("distances", &BoundSolid::distances, "points"_a)
        .def_prop_ro("address", &BoundSolid::address);
    nb::class_<BoundSolids>(module, "Solids")
        .def(nb::init<const nb::list&>(), "solids"_a)
        .def("distances", &BoundSolids::distances, "points"_a)
        .def_prop_ro("address", &BoundSolids::address);
    nb::class_<BoundBeams>(module, "Beams")
        .def(nb::init<const BoundBeams::Balls&, const Vector<int32_t>&, double>(), "balls"_a, "chains"_a, "seam"_a)
        .def("distances", &BoundBeams::distances, "points"_a)
        .def_prop_ro("address", &BoundBeams::address);
    nb::class_<BoundOutline>(module, "Outline")
        .def(nb::init<const Rows<double, 2>&, const Vector<int64_t>&>(), "corners"_a, "ends"_a)
        .def("distances", &BoundOutline::distances, "points"_a)
        .def_prop_ro("address", &BoundOutline::address);
    nb::class_<BoundRelief>(module, "Relief")
        .def(nb::init<const BoundRelief::Grid&, double, double, bool>(), "heights"_a, "across"_a, "up"_a, "wraps"_a)
        .def("distances", &BoundRelief::distances, "points"_a)
        .def_prop_ro("address", &BoundRelief::address);
}

}  // namespace fracslice::mesh
