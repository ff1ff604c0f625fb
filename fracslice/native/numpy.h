// Arrays across the border: views of NumPy arrays in, owned NumPy arrays out.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>

#include <cstring>
#include <span>
#include <stdexcept>
#include <vector>

#include "array.h"

namespace fracslice {

namespace nb = nanobind;

template <class T>
using Vector = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T, size_t columns = 3>
using Rows = nb::ndarray<const T, nb::shape<-1, nb::ssize_t(columns)>, nb::c_contig, nb::device::cpu>;

template <class T, class... Shape>
std::span<const T> span_of(const nb::ndarray<const T, Shape...>& values) {
    return {values.data(), values.size()};
}

inline void require(bool holds, const char* what) {
    if (!holds) throw std::invalid_argument(what);
}

// What act() returns; other threads of Python run meanwhile.
template <class Do>
auto released(const Do& act) {
    nb::gil_scoped_release released;
    return act();
}

template <class T>
nb::object to_numpy(Array<T>&& array, std::initializer_list<size_t> shape) {
    T* data = array.data.release();
    nb::capsule owner(data, [](void* p) noexcept { std::free(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(data, shape, owner));
}

// Values that consist of one T or several.
template <class T, class Row>
nb::object to_numpy(const std::vector<Row>& rows, std::initializer_list<size_t> shape) {
    static_assert(sizeof(Row) % sizeof(T) == 0);
    Array<T> array(rows.size(), sizeof(Row) / sizeof(T));
    if (!rows.empty()) std::memcpy(array.data.get(), rows.data(), rows.size() * sizeof(Row));
    return to_numpy(std::move(array), shape);
}

template <class T, class Row>
nb::object to_numpy(const std::vector<Row>& rows) {
    return to_numpy<T>(rows, {rows.size(), sizeof(Row) / sizeof(T)});
}

}  // namespace fracslice
