#include "export.h"

#include <bit>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "blocks.h"
#include "triangles.h"

namespace fracslice::mesh {
namespace {

static_assert(std::endian::native == std::endian::little, "STL is little-endian");

void write(const MeshView& mesh, size_t t, uint8_t* out) {
    float numbers[4][3];  // the normal, then the corners
    Vec3 corners[3];
    for (int k = 0; k < 3; ++k) {
        for (size_t i = 0; i < 3; ++i) corners[k][i] = numbers[k + 1][i] = float(mesh.corner(t, k)[i]);
    }
    Vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
    double length = std::sqrt(dot(normal, normal));
    for (size_t i = 0; i < 3; ++i) numbers[0][i] = float(length == 0 ? normal[i] : normal[i] / length);
    std::memcpy(out, numbers, sizeof numbers);
    std::memset(out + sizeof numbers, 0, kStlBytes - sizeof numbers);
}

}  // namespace

void write_stl(const MeshView& mesh, uint8_t* out) {
    for_each_number(mesh.count, [&](size_t t) { write(mesh, t, out + kStlBytes * t); });
}

namespace {

constexpr size_t kLongest = 24;  // characters of a number

}  // namespace

template <class Number>
std::string text_rows(std::span<const Number> values, const std::vector<std::string>& before, const std::string& end) {
    const size_t columns = before.size();
    assert(columns > 0 && values.size() % columns == 0);
    size_t longest = end.size() + kLongest * columns;
    for (const std::string& text : before) longest += text.size();
    std::string result(values.size() / columns * longest, '\0');
    char* to = result.data();
    for (size_t i = 0; i < values.size(); i += columns) {
        for (size_t k = 0; k < columns; ++k) {
            to += before[k].copy(to, before[k].size());
            to = std::to_chars(to, to + kLongest, values[i + k]).ptr;
        }
        to += end.copy(to, end.size());
    }
    result.resize(size_t(to - result.data()));
    return result;
}

template std::string text_rows(std::span<const float>, const std::vector<std::string>&, const std::string&);
template std::string text_rows(std::span<const int64_t>, const std::vector<std::string>&, const std::string&);

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
