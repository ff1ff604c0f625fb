// The sides of an object, climbs to its tips, and the signs of samples, for fracslice._native.
#include "../unlocked.h"
#include "bind_field.h"
#include "brick_arrays.h"
#include "extent.h"
#include "regions.h"
#include "signs.h"

#include <tbb/parallel_for.h>

namespace fracslice::volume {
namespace {

using Rows3 = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Row = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// The six sides of an object, lower ones first, in the order of the axes.
class Sides {
  public:
    Sides(const Sides&) = delete;  // field_ refers to members
    Sides(nb::object sign, nb::object conservative, double lipschitz, bool far, const Point& lo, const Point& hi, int threads)
        : sign_(field_values(sign)), conservative_(field_values(conservative)), field_{sign_, conservative_, lipschitz, far},
          threads_(threads) {
        for (int k = 0; k < 6; ++k) sides_.emplace_back(lo, hi, k % 3, k < 3 ? -1 : 1);
    }

    // points[:, k] are of side k.
    void learn(const Rows3& points) {
        if (points.shape(0) != 3 || points.shape(1) != sides_.size()) throw nb::value_error("expected rows of x, y, z by side");
        const size_t n = points.shape(2), row = n * sides_.size();
        for (size_t k = 0; k < sides_.size(); ++k) {
            for (const double* p = points.data() + n * k; p < points.data() + n * (k + 1); ++p) {
                if (p[0] == p[0]) sides_[k].learn({p[0], p[row], p[2 * row]});
            }
        }
    }
    void guess(double share, double aim, size_t most) {
        each([&](Side& side) { side.guess(field_, share, aim, most); });
    }
    void prove(double aim, size_t most) {
        each([&](Side& side) { side.prove(field_, aim, most); });
    }

    nb::object best() const {
        Array<double> points(3, sides_.size() * kBest);
        double* to = points.data.get();
        for (size_t axis = 0; axis < 3; ++axis) {
            for (const Side& side : sides_) {
                for (const Point& p : side.best()) *to++ = p[axis];
            }
        }
        return to_numpy(std::move(points), {3, sides_.size(), kBest});
    }
    nb::object known() const {
        return of_sides([](const Side& side) { return side.known(); });
    }
    nb::object above() const {
        return of_sides([](const Side& side) { return side.above(); });
    }
    nb::object spent() const {
        return of_sides([](const Side& side) { return double(side.spent()); });
    }

  private:
    template <class Do>
    void each(const Do& act) {
        unlocked(threads_, [&] {
            tbb::parallel_for(size_t(0), sides_.size(), [&](size_t k) { act(sides_[k]); });
        });
    }
    template <class Value>
    nb::object of_sides(const Value& value) const {
        Array<double> values(sides_.size(), 1);
        for (size_t k = 0; k < sides_.size(); ++k) values.data[k] = value(sides_[k]);
        return to_numpy(std::move(values), {sides_.size()});
    }

    FieldValues sign_, conservative_;
    FreeSpace field_;
    int threads_;
    std::vector<Side> sides_;
};

nb::object climbed(nb::object entry, const Rows3& starts, const Rows3& steps, const Row& gain, double first, double exact,
                   int threads) {
    const size_t n = starts.shape(1), each = starts.shape(2), count = gain.shape(0), row = n * each, all = n * count;
    if (starts.shape(0) != 3 || steps.shape(0) != 3 || steps.shape(1) != n || steps.shape(2) != count) {
        throw nb::value_error("expected starts and steps of as many directions, and gains of as many steps");
    }
    FieldValues field = field_values(entry);
    Array<double> points(3, row);
    double* p = points.data.get();
    std::copy_n(starts.data(), 3 * row, p);
    const double* w = steps.data();
    unlocked(threads, [&] {
        climb(field, {p, p + row, p + 2 * row}, n, each, {w, w + all, w + 2 * all, gain.data(), count}, first, exact);
    });
    return to_numpy(std::move(points), {3, n, each});
}

nb::object measured(nb::object entry, const nb::ndarray<const double, nb::shape<-1, 3>, nb::device::cpu>& points, double scale,
                    const Point& offset, const nb::ndarray<const double, nb::shape<26, 3>, nb::c_contig, nb::device::cpu>& steps,
                    double step, double voxel, int threads) {
    const size_t n = points.shape(0);
    FieldValues field = field_values(entry);
    Array<double> errors(n, 1);
    const PlacedPoints placed{points.data(), points.stride(0), points.stride(1), scale, offset};
    unlocked(threads, [&] {
        surface_error(field, placed, {steps.data(), step}, voxel, {errors.data.get(), n});
    });
    return to_numpy(std::move(errors), {n});
}

nb::object signs(const ValuesArray& values, int threads) {
    Bricks bricks{{nullptr, values.shape(0), nullptr, {}}, values.data()};
    std::vector<Signs> result = unlocked(threads, [&] { return signs_of(bricks); });
    Array<uint8_t> bytes(result.size(), sizeof(Signs));
    std::copy_n(reinterpret_cast<const uint8_t*>(result.data()), result.size() * sizeof(Signs), bytes.data.get());
    return to_numpy(std::move(bytes), {result.size(), kSide, kSide});
}

int64_t count_open_edges(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index) {
    Bricks bricks = view(ijk, values, index);
    nb::gil_scoped_release released;
    check(bricks);
    return open_edges(bricks, signs_of(bricks));
}

// Regions of a long union; holds what they read.
class RegionsOfUnion {
  public:
    RegionsOfUnion(nb::object points, const Numbers& numbers, size_t width, double smooth, double lipschitz, const Point& centre, double half)
        : points_(points), numbers_(numbers),
          regions_({reinterpret_cast<Elements::Points>(nb::cast<uintptr_t>(points.attr("address"))), numbers.data(), numbers.shape(0),
                    numbers.shape(1), std::max<size_t>(width, 1), smooth, lipschitz},
                   centre, half),
          of_points_(near_points_of(regions_)), of_bricks_(near_bricks_of(regions_)) {}
    const Near& of_points() const { return of_points_; }
    const Near& of_bricks() const { return of_bricks_; }

  private:
    nb::object points_;
    Numbers numbers_;
    Regions regions_;
    Near of_points_, of_bricks_;
};

}  // namespace

void bind_extent(nb::module_& module) {
    using namespace nanobind::literals;
    nb::class_<RegionsOfUnion>(module, "Regions")
        .def(nb::init<nb::object, const Numbers&, size_t, double, double, const Point&, double>(), "points"_a, "numbers"_a, "width"_a,
             "smooth"_a, "lipschitz"_a, "centre"_a, "half"_a)
        .def_prop_ro("points", &RegionsOfUnion::of_points)
        .def_prop_ro("bricks", &RegionsOfUnion::of_bricks);
    nb::class_<Near>(module, "Near").def_prop_ro("address", [](const Near& near) { return reinterpret_cast<uintptr_t>(&near); });
    nb::class_<Sides>(module, "Sides")
        .def(nb::init<nb::object, nb::object, double, bool, const Point&, const Point&, int>(), "sign"_a, "conservative"_a,
             "lipschitz"_a, "far"_a, "lo"_a, "hi"_a, "threads"_a = 0)
        .def("learn", &Sides::learn, "points"_a)
        .def("guess", &Sides::guess, "share"_a, "aim"_a, "most"_a)
        .def("prove", &Sides::prove, "aim"_a, "most"_a)
        .def_prop_ro("best", &Sides::best)
        .def_prop_ro("known", &Sides::known)
        .def_prop_ro("above", &Sides::above)
        .def_prop_ro("spent", &Sides::spent);
    module.def("surface_error", &measured, "field"_a, "points"_a, "scale"_a, "offset"_a, "steps"_a, "step"_a, "voxel"_a,
               "threads"_a = 0);
    module.def("climb", &climbed, "field"_a, "starts"_a, "steps"_a, "gain"_a, "first"_a, "exact"_a, "threads"_a = 0);
}

void bind_signs(nb::module_& module) {
    using namespace nanobind::literals;
    module.def("signs", &signs, "values"_a, "threads"_a = 0);
    module.def("open_edges", &count_open_edges, "ijk"_a, "values"_a, "index"_a);
}

}  // namespace fracslice::volume
