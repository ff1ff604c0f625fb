// Meshes that come in from Python: looked through once, for no index may leave its array.
#pragma once
#include <limits>
#include <span>
#include <stdexcept>
#include <type_traits>

#include "../numpy.h"
#include "triangles.h"

namespace fracslice::mesh {

// Throws std::invalid_argument unless all values are at least `least`, which is not positive, and below `end`.
template <class T>
void require_below(std::span<const T> values, size_t end, const char* what, std::type_identity_t<T> least = 0) {
    using Unsigned = std::make_unsigned_t<T>;  // what is less than `least` is then larger than all
    const Unsigned from = Unsigned(least), most = Unsigned(std::min(end, size_t(std::numeric_limits<T>::max()) + 1)) - from;
    std::atomic<bool> result = false;
    for_each_block(values.size(), [&](size_t, size_t first, size_t last) {
        Unsigned largest = 0;
        for (size_t i = first; i < last; ++i) largest = std::max(largest, Unsigned(Unsigned(values[i]) - from));
        if (largest >= most) result.store(true, std::memory_order_relaxed);
    });
    if (result) throw std::invalid_argument(what);
}

inline Triangles triangles_of(const Rows<int32_t>& triangles, size_t vertices) {
    require_below(span_of(triangles), vertices, "a triangle names a vertex that does not exist");
    return {triangles.data(), triangles.shape(0), vertices};
}

inline MeshView mesh_of(const Rows<double>& vertices, const Rows<int32_t>& triangles) {
    return {triangles_of(triangles, vertices.shape(0)), vertices.data()};
}

inline TreeView tree_of(const MeshView& mesh, const Vector<int64_t>& order, const Rows<double>& low, const Rows<double>& high) {
    TreeView tree{order.data(), low.data(), high.data(), order.size(), low.shape(0) / 2};
    size_t leaves = 1;
    while (leaves * kLeaf < mesh.count) leaves *= 2;
    if (order.size() != mesh.count || low.shape(0) != 2 * leaves || high.shape(0) != 2 * leaves) {
        throw std::invalid_argument("the tree is not of this mesh");
    }
    require_below(span_of(order), mesh.count, "the tree names a triangle that does not exist");
    return tree;
}

}  // namespace fracslice::mesh
