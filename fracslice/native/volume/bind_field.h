// Fields that come in from Python.
#pragma once
#include "../machine.h"
#include "../numpy.h"
#include "field_values.h"

namespace fracslice::volume {

template <class Real>
FieldValues compiled(const Machine<Real>& code) {
    using R = const Real*;
    auto run = code.template function<R, R, R, R, Real*, ptrdiff_t>();
    return in_batches<Real>([code, run, p = code.array(1)](R x, R y, R z, Real* f, size_t n) { run(p, x, y, z, f, ptrdiff_t(n)); });
}

// Of `Kernel.entry`: machine code in either precision, or a function of points [3, n] that writes their values to [1, n].
inline FieldValues field_values(nb::object entry) {
    if (nb::isinstance<nb::tuple>(entry)) {
        const bool single = nb::cast<nb::ndarray<nb::ro>>(entry[1]).dtype() == nb::dtype<float>();
        return single ? compiled(Machine<float>(entry)) : compiled(Machine<double>(entry));
    }
    return [entry](const Rows& rows, size_t n) {
        nb::gil_scoped_acquire locked;
        Array<double> points(3, n), values(1, n);
        size_t k = 0;
        for (const double* row : {rows.x, rows.y, rows.z}) std::copy_n(row, n, &points.data[n * k++]);
        double* f = values.data.get();  // the array below owns it
        nb::object out = to_numpy(std::move(values), {1, n});
        entry(to_numpy(std::move(points), {3, n}), out);
        std::copy_n(f, n, rows.f);
    };
}

}  // namespace fracslice::volume
