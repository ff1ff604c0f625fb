// The signs of samples, for fracslice._native.
#include "../unlocked.h"
#include "brick_arrays.h"
#include "signs.h"

namespace fracslice::volume {
namespace {

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

}  // namespace

void bind_signs(nb::module_& module) {
    using namespace nanobind::literals;
    module.def("signs", &signs, "values"_a, "threads"_a = 0);
    module.def("open_edges", &count_open_edges, "ijk"_a, "values"_a, "index"_a);
}

}  // namespace fracslice::volume
