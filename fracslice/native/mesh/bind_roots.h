// Loops over a field, compiled or in Python, as native code calls them.
#pragma once
#include "../volume/bind_field.h"
#include "roots.h"

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

}  // namespace fracslice::mesh
