#include "stl.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "blocks.h"
#include "vec3.h"

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

}  // namespace fracslice::mesh
