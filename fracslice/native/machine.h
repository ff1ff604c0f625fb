// Machine code as native code calls it.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace fracslice {

// A loop that fracslice.expr compiled, and the arrays that it is always called with: a tuple of a
// `fracslice.expr.runtime.Function` and arrays of Real. Holds them; copied and let go with the interpreter's lock only.
template <class Real>
class Machine {
  public:
    explicit Machine(nanobind::handle tuple) : parts_(nanobind::cast<nanobind::tuple>(tuple)) {}

    // Throws where the loop takes other arguments.
    template <class... Arguments>
    auto function() const -> void (*)(Arguments...) {
        constexpr char expected[] = {(std::is_pointer_v<Arguments> ? 'r' : 'n')..., 0};
        if (std::strcmp(nanobind::cast<const char*>(parts_[0].attr("arguments")), expected) != 0)
            throw nanobind::type_error("the loop takes other arguments");
        return reinterpret_cast<void (*)(Arguments...)>(nanobind::cast<uintptr_t>(parts_[0].attr("address")));
    }
    const Real* array(size_t k) const {
        using Rows = nanobind::ndarray<const Real, nanobind::ndim<1>, nanobind::c_contig, nanobind::device::cpu>;
        return nanobind::cast<Rows>(parts_[k], false).data();  // a view of what the tuple holds, not a copy
    }

  private:
    nanobind::tuple parts_;
};

}  // namespace fracslice
