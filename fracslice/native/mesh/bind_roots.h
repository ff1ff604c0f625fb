// Loops over a field, compiled or in Python, as native code calls them.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>

#include "../machine.h"
#include "roots.h"

namespace fracslice::mesh {

namespace nb = nanobind;

template <class Real>
auto compiled_find(const Machine<Real>& code) {
    using R = const Real*;
    auto run = code.template function<R, R, R, R, R, R, R, R, Real*, ptrdiff_t, ptrdiff_t>();
    return [code, run, p = code.array(1), frame = code.array(2)](R s, Real* roots, size_t steps, size_t n) {
        run(p, frame, s, s + n, s + 2 * n, s + 3 * n, s + 4 * n, s + 5 * n, roots, ptrdiff_t(steps), ptrdiff_t(n));
    };
}

inline auto compiled_polish(const Machine<double>& code) {
    using R = const double*;
    using W = double*;
    auto run = code.function<R, R, R, R, R, R, R, R, W, W, W, W, W, ptrdiff_t>();
    return [code, run, p = code.array(1), frame = code.array(2)](R s, W out, size_t n) {
        run(p, frame, s, s + n, s + 2 * n, s + 3 * n, s + 4 * n, s + 5 * n, out, out + n, out + 2 * n, out + 3 * n, out + 4 * n,
            ptrdiff_t(n));
    };
}

inline auto compiled_field(const Machine<double>& code) {
    using R = const double*;
    auto run = code.function<R, R, R, R, double*, ptrdiff_t>();
    return [code, run, p = code.array(1)](R points, double* values, size_t n) {
        run(p, points, points + n, points + 2 * n, values, ptrdiff_t(n));
    };
}

// A Python function of some rows of n numbers, those that it writes, and perhaps a number of steps.
template <class Real, class... Steps>
void call(const nb::object& function, const Real* in, size_t in_rows, Real* out, size_t out_rows, size_t n, Steps... steps) {
    nb::gil_scoped_acquire locked;
    auto view = [n](auto* p, size_t count) {
        return nb::cast(nb::ndarray<nb::numpy, Real, nb::ndim<2>>(const_cast<Real*>(p), {count, n}, nb::handle()),
                        nb::rv_policy::reference);
    };
    function(view(in, in_rows), view(out, out_rows), steps...);
}

// Of a loop that is either.
template <class Real>
std::function<void(const Real*, Real*, size_t, size_t)> find_loop(nb::object loop) {
    if (nb::isinstance<nb::tuple>(loop)) return compiled_find(Machine<Real>(loop));
    return [=](const Real* s, Real* roots, size_t steps, size_t n) { call(loop, s, 6, roots, 1, n, steps); };
}

inline std::function<void(const double*, double*, size_t)> polish_loop(nb::object loop) {
    if (nb::isinstance<nb::tuple>(loop)) return compiled_polish(Machine<double>(loop));
    return [=](const double* s, double* out, size_t n) { call(loop, s, 6, out, 5, n); };
}

inline std::function<void(const double*, double*, size_t)> field_loop(nb::object loop) {
    if (nb::isinstance<nb::tuple>(loop)) return compiled_field(Machine<double>(loop));
    return [=](const double* points, double* values, size_t n) { call(loop, points, 3, values, 1, n); };
}

inline RootLoops root_loops(size_t lanes, size_t batch, nb::object guess, nb::object find, nb::object polish, nb::object field,
                            std::pair<size_t, size_t> steps, double sure) {
    return {lanes, batch, find_loop<float>(guess), find_loop<double>(find), polish_loop(polish), field_loop(field),
            steps.first, steps.second, sure};
}

}  // namespace fracslice::mesh
