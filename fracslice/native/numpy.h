// Arrays across the border: views of NumPy arrays in, owned NumPy arrays out.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>

#include <algorithm>
#include <vector>

#include "marching_cubes.h"

namespace fracslice {

namespace nb = nanobind;

using IjkArray = nb::ndarray<const int32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using ValuesArray = nb::ndarray<const float, nb::shape<-1, kSamples>, nb::c_contig, nb::device::cpu>;
using SignsArray = nb::ndarray<const uint8_t, nb::shape<-1, kSide, kSide>, nb::c_contig, nb::device::cpu>;
using RootsArray = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using NormalsArray = nb::ndarray<const float, nb::shape<3, -1>, nb::device::cpu>;
using RootsOut = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using NormalsOut = nb::ndarray<float, nb::shape<3, -1>, nb::device::cpu>;
using IndexArray = nb::ndarray<const int32_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

inline Layout layout(const IjkArray& ijk, const IndexArray& index) {
    std::array<int, 3> size = {int(index.shape(0)), int(index.shape(1)), int(index.shape(2))};
    return {ijk.data(), ijk.shape(0), index.data(), size};
}

inline Bricks view(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index) {
    if (ijk.shape(0) != values.shape(0)) throw nb::value_error("ijk and values differ in length");
    return {layout(ijk, index), values.data()};
}

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

void bind_grid(nb::module_& module);
void bind_mesh(nb::module_& module);

}  // namespace fracslice
