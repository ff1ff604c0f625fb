// Arrays across the border: owned NumPy arrays out.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>

#include <algorithm>
#include <vector>

#include "array.h"

namespace fracslice {

namespace nb = nanobind;

template <class T>
nb::object to_numpy(Array<T>&& array, std::initializer_list<size_t> shape) {
    T* data = array.data.release();
    nb::capsule owner(data, [](void* p) noexcept { std::free(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(data, shape, owner));
}

template <class T, class Row>
nb::object to_numpy(const std::vector<Row>& rows) {
    constexpr size_t columns = sizeof(Row) / sizeof(T);
    Array<T> array(rows.size(), columns);
    std::copy_n(reinterpret_cast<const T*>(rows.data()), rows.size() * columns, array.data.get());
    return to_numpy(std::move(array), {rows.size(), columns});
}

}  // namespace fracslice
