#include "filter.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <vector>

namespace fracslice::slices {
namespace {

uint8_t paeth(int left, int above, int corner) {
    const int a = std::abs(above - corner), b = std::abs(left - corner), c = std::abs(left + above - 2 * corner);
    return uint8_t(a <= b && a <= c ? left : b <= c ? above : corner);
}

template <class Predict>
uint32_t filtered(const uint8_t* row, const uint8_t* above, size_t width, size_t pixel, uint8_t* out, Predict predict) {
    uint32_t sum = 0;
    for (size_t k = 0; k < width; ++k) {
        const int left = k < pixel ? 0 : row[k - pixel], corner = k < pixel ? 0 : above[k - pixel];
        out[k] = uint8_t(row[k] - predict(left, above[k], corner));
        sum += uint32_t(std::abs(int8_t(out[k])));
    }
    return sum;
}

}  // namespace

void filter_rows(const uint8_t* rows, size_t count, size_t width, size_t pixel, uint8_t* out) {
    std::array<std::vector<uint8_t>, 5> tried;
    for (auto& bytes : tried) bytes.resize(width);
    for (size_t y = 0; y < count; ++y, out += width + 1) {
        const uint8_t *above = rows + y * width, *row = above + width;
        const auto sum = [&](size_t kind, auto predict) {
            return filtered(row, above, width, pixel, tried[kind].data(), predict);
        };
        const std::array<uint32_t, 5> sums{sum(0, [](int, int, int) { return 0; }),
                                           sum(1, [](int left, int, int) { return left; }),
                                           sum(2, [](int, int up, int) { return up; }),
                                           sum(3, [](int left, int up, int) { return (left + up) / 2; }), sum(4, paeth)};
        const size_t best = size_t(std::min_element(sums.begin(), sums.end()) - sums.begin());
        out[0] = uint8_t(best);
        std::copy(tried[best].begin(), tried[best].end(), out + 1);
    }
}

}  // namespace fracslice::slices
