#include "export.h"

#include <bit>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "quantise.h"
#include "triangles.h"

namespace fracslice::mesh {
namespace {

// Cells of a grid around a mesh, some of them marked.
class CoarseGrid {
  public:
    explicit CoarseGrid(const MeshView& mesh) : mesh_(mesh), cells_(mesh.vertices, 1), marked_(kSide * kSide * kSide, false) {
        Bounds box = bounds({mesh.positions, 3 * mesh.vertices});
        double size = 0;
        for (size_t k = 0; k < 3; ++k) size = std::max(size, box.high[k] - box.low[k]);
        double scale = size > 0 ? kSide / size : 0;
        for_each_number(mesh.vertices, [&](size_t v) {
            const double* p = mesh.point(int32_t(v));
            for (size_t k = 0; k < 3; ++k) cells_.data[v][k] = uint8_t(std::min((p[k] - box.low[k]) * scale, kSide - 1.0));
            cells_.data[v][3] = 0;
        });
    }

    // Calls act(marked) for the cells of a triangle's box, until it returns true, and whether it did.
    template <class Do>
    bool any(size_t t, const Do& act) {
        const Cell &a = cell(t, 0), &b = cell(t, 1), &c = cell(t, 2);
        if (same(a, b) && same(b, c)) return act(marked_[at(a[0], a[1], a[2])]);
        std::array<size_t, 3> first, last;
        for (size_t k = 0; k < 3; ++k) first[k] = std::min({a[k], b[k], c[k]}), last[k] = std::max({a[k], b[k], c[k]});
        for (size_t x = first[0]; x <= last[0]; ++x) {
            for (size_t y = first[1]; y <= last[1]; ++y) {
                for (size_t z = first[2]; z <= last[2]; ++z) {
                    if (act(marked_[at(x, y, z)])) return true;
                }
            }
        }
        return false;
    }

  private:
    static constexpr size_t kSide = 64;
    using Cell = std::array<uint8_t, 4>;

    static bool same(const Cell& a, const Cell& b) { return std::bit_cast<uint32_t>(a) == std::bit_cast<uint32_t>(b); }
    static size_t at(size_t x, size_t y, size_t z) { return (x * kSide + y) * kSide + z; }
    const Cell& cell(size_t t, int k) const { return cells_.data[size_t(mesh_[t][k])]; }

    const MeshView& mesh_;
    Array<Cell> cells_;  // of the vertices
    std::vector<uint8_t> marked_;
};

}  // namespace

Selection selected(const MeshView& mesh, std::span<const bool> keep) {
    assert(keep.size() == mesh.count);
    std::vector<std::atomic<bool>> used(mesh.vertices);
    for_each_number(mesh.count, [&](size_t t) {
        for (int k = 0; keep[t] && k < 3; ++k) used[size_t(mesh[t][k])].store(true, std::memory_order_relaxed);
    });
    auto is_used = [&](size_t v) { return used[v].load(std::memory_order_relaxed); };
    std::vector<size_t> vertices = counted(mesh.vertices, is_used);
    std::vector<size_t> triangles = counted(mesh.count, [&](size_t t) { return keep[t]; });
    Selection result{{vertices.back(), 3}, {triangles.back(), 3}};
    if (vertices.back() == mesh.vertices && triangles.back() == mesh.count) return result;
    Array<int32_t> number(mesh.vertices, 1);
    for_each_block(mesh.vertices, [&](size_t block, size_t first, size_t last) {
        size_t next = vertices[block];
        for (size_t v = first; v < last; ++v) {
            number.data[v] = int32_t(next);
            if (is_used(v)) std::copy_n(mesh.point(int32_t(v)), 3, &result.vertices.data[3 * next++]);
        }
    });
    for_each_block(mesh.count, [&](size_t block, size_t first, size_t last) {
        int32_t* out = result.triangles.data.get() + 3 * triangles[block];
        for (size_t t = first; t < last; ++t) {
            for (int k = 0; keep[t] && k < 3; ++k) *out++ = number.data[mesh[t][k]];
        }
    });
    return result;
}

Ordered in_order(const Triangles& triangles) {
    std::vector<int32_t> number(triangles.vertices, -1);
    Ordered result{{triangles.vertices, 1}, {triangles.count, 3}};
    int32_t used = 0;
    for (size_t i = 0; i < 3 * triangles.count; ++i) {
        const int32_t vertex = triangles.corners[i];
        if (number[size_t(vertex)] < 0) {
            result.first.data[used] = vertex;
            number[size_t(vertex)] = used++;
        }
        result.triangles.data[i] = number[size_t(vertex)];
    }
    result.first.rows = size_t(used);
    return result;
}

std::vector<int64_t> touching(const Triangles& triangles, std::span<const bool> vertices) {
    assert(vertices.size() == triangles.vertices);
    return chosen(triangles.count, [&](size_t t) {
        const int32_t* corners = triangles[t];
        return vertices[size_t(corners[0])] + vertices[size_t(corners[1])] + vertices[size_t(corners[2])] > 0;  // no branch
    });
}

std::vector<int64_t> near(const MeshView& mesh, std::span<const double> points, double reach) {
    constexpr size_t kMost = 128;
    Bounds box = bounds(points);
    double size = reach;
    for (size_t k = 0; k < 3; ++k) size = std::max(size, (box.high[k] - box.low[k]) / kMost);
    constexpr size_t side = kMost + 4;  // a point in the second cell to the last but one marks those beside its own, too
    auto place = [&](const double* p, size_t k) { return size_t(std::clamp((p[k] - box.low[k]) / size + 2, 0.0, side - 1.0)); };
    std::vector<uint8_t> marked(side * side * side, false);
    for (size_t i = 0; i + 3 <= points.size(); i += 3) {
        size_t x = place(&points[i], 0), y = place(&points[i], 1), z = place(&points[i], 2);
        for (size_t k = 0; k < 27; ++k) marked[((x + k / 9 - 1) * side + y + k / 3 % 3 - 1) * side + z + k % 3 - 1] = true;
    }
    Array<bool> seen(mesh.vertices, 1);
    for_each_number(mesh.vertices, [&](size_t v) {
        const double* p = mesh.point(int32_t(v));
        seen.data[v] = marked[(place(p, 0) * side + place(p, 1)) * side + place(p, 2)];
    });
    return touching(mesh, {seen.data.get(), mesh.vertices});
}

std::vector<int64_t> surroundings(const MeshView& mesh, std::span<const bool> of) {
    assert(of.size() == mesh.count);
    CoarseGrid grid(mesh);
    for (int64_t t : chosen(mesh.count, [&](size_t t) { return of[t]; })) {
        grid.any(size_t(t), [](uint8_t& marked) { return marked = true, false; });
    }
    return chosen(mesh.count, [&](size_t t) { return grid.any(t, [](uint8_t marked) { return marked != 0; }); });
}

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
        // pixels whose centres lie within the box of the triangle: most small triangles have none
        auto first = [&](int k, int most) {
            return int(std::clamp(std::ceil(std::min({a[k], b[k], c[k]}) - 0.5), 0.0, double(most)));
        };
        auto end = [&](int k, int most) {
            return int(std::clamp(std::floor(std::max({a[k], b[k], c[k]}) - 0.5) + 1, 0.0, double(most)));
        };
        const int left = first(0, width), right = end(0, width), last = end(1, height);
        for (int i = first(1, height); i < last; ++i) {
            for (int j = left; j < right; ++j) {
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
