// Views of the NumPy arrays of fracslice.volume.bricks.Bricks.
#pragma once
#include "../numpy.h"
#include "signs.h"

namespace fracslice::volume {

using IjkArray = nb::ndarray<const int32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using ValuesArray = nb::ndarray<const float, nb::shape<-1, kSamples>, nb::c_contig, nb::device::cpu>;
using SignsArray = nb::ndarray<const uint8_t, nb::shape<-1, kSide, kSide>, nb::c_contig, nb::device::cpu>;
using IndexArray = nb::ndarray<const int32_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

inline Layout layout(const IjkArray& ijk, const IndexArray& index) {
    std::array<int, 3> size = {int(index.shape(0)), int(index.shape(1)), int(index.shape(2))};
    return {ijk.data(), ijk.shape(0), index.data(), size};
}

inline Bricks view(const IjkArray& ijk, const ValuesArray& values, const IndexArray& index) {
    if (ijk.shape(0) != values.shape(0)) throw nb::value_error("ijk and values differ in length");
    return {layout(ijk, index), values.data()};
}

}  // namespace fracslice::volume
