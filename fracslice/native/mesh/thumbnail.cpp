#include "thumbnail.h"

#include <cmath>

namespace fracslice::mesh {

std::vector<int32_t> foremost(const MeshView& mesh, int height, int width) {
    const size_t pixels = size_t(height) * size_t(width);
    std::vector<int32_t> front(pixels, -1);
    std::vector<double> depth(pixels, -HUGE_VAL);
    for (size_t t = 0; t < mesh.count; ++t) {
        const double *a = mesh.corner(t, 0), *b = mesh.corner(t, 1), *c = mesh.corner(t, 2);
        const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if (area == 0) continue;
        auto first = [&](int k) { return std::max(int(std::min({a[k], b[k], c[k]})), 0); };
        auto end = [&](int k, int most) { return std::min(int(std::max({a[k], b[k], c[k]})) + 1, most); };
        for (int i = first(1); i < end(1, height); ++i) {
            for (int j = first(0); j < end(0, width); ++j) {
                const double x = j + 0.5 - a[0], y = i + 0.5 - a[1];
                const double v = (x * (c[1] - a[1]) - y * (c[0] - a[0])) / area;
                const double w = ((b[0] - a[0]) * y - (b[1] - a[1]) * x) / area;
                if (v < 0 || w < 0 || v + w > 1) continue;
                const double z = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]);
                const size_t pixel = size_t(i) * size_t(width) + size_t(j);
                if (z > depth[pixel]) depth[pixel] = z, front[pixel] = int32_t(t);
            }
        }
    }
    return front;
}

}  // namespace fracslice::mesh
