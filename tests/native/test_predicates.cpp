// Signs of predicates against sums of integers.
#include <doctest/doctest.h>

#include <array>
#include <random>

#include "mesh/predicates.h"

namespace fracslice::mesh {
namespace {

__extension__ using Wide = __int128;
using Integers = std::array<int64_t, 3>;
using Numbers = std::array<double, 3>;

int sign(Wide x) { return (x > 0) - (x < 0); }

int plane_by_integers(const Integers& a, const Integers& b, const Integers& c, const Integers& d) {
    std::array<std::array<Wide, 3>, 3> m;
    for (size_t k = 0; k < 3; ++k) m[0][k] = a[k] - d[k], m[1][k] = b[k] - d[k], m[2][k] = c[k] - d[k];
    Wide det = 0;
    for (size_t k = 0; k < 3; ++k) det += m[0][k] * (m[1][(k + 1) % 3] * m[2][(k + 2) % 3] - m[1][(k + 2) % 3] * m[2][(k + 1) % 3]);
    return sign(det);
}

// The point in units of 2^-30, which are no round numbers where they are added to others.
Numbers scaled(const Integers& p) { return {double(p[0]) * 0x1p-30, double(p[1]) * 0x1p-30, double(p[2]) * 0x1p-30}; }

int plane(const Integers& a, const Integers& b, const Integers& c, const Integers& d) {
    return side_of_plane(scaled(a).data(), scaled(b).data(), scaled(c).data(), scaled(d).data());
}

}  // namespace

TEST_CASE("side_of_line: points on a line and an ulp beside it") {
    CHECK(side_of_line(0, 0, 1, 0, 0, 1) == 1);
    CHECK(side_of_line(0, 0, 0, 1, 1, 0) == -1);
    CHECK(side_of_line(0.1, 0.1, 0.2, 0.2, 0.3, 0.3) == 0);
    CHECK(side_of_line(12, 12, 24, 24, 0.5, 0.5) == 0);
    CHECK(side_of_line(12, 12, 24, 24, 0.5, std::nextafter(0.5, 1)) == 1);
    CHECK(side_of_line(12, 12, 24, 24, 0.5, std::nextafter(0.5, 0)) == -1);
}

TEST_CASE("side_of_line: exact for any integers") {
    std::mt19937_64 random(1);
    std::uniform_int_distribution<int64_t> far(-(int64_t(1) << 40), int64_t(1) << 40), near(-1, 1);
    for (int i = 0; i < 20000; ++i) {
        const int64_t ax = far(random), ay = far(random), dx = far(random) >> 21, dy = far(random) >> 21, n = far(random) >> 25;
        const int64_t bx = ax + dx, by = ay + dy, cx = ax + n * dx + near(random), cy = ay + n * dy + near(random);
        const int expected = sign(Wide(ax - cx) * (by - cy) - Wide(ay - cy) * (bx - cx));
        CHECK(side_of_line(double(ax), double(ay), double(bx), double(by), double(cx), double(cy)) == expected);
    }
}

TEST_CASE("side_of_plane: exact for points in a plane and beside it, in any order") {
    CHECK(plane({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}) == 1);
    std::mt19937_64 random(2);
    std::uniform_int_distribution<int64_t> far(-(int64_t(1) << 30), int64_t(1) << 30), few(-7, 7), near(-1, 1);
    int flat = 0;
    for (int i = 0; i < 20000; ++i) {
        Integers a, u, v, b, c, d;
        const int64_t s = few(random), t = few(random);
        for (size_t k = 0; k < 3; ++k) {
            a[k] = far(random), u[k] = far(random) >> 4;
            v[k] = i % 4 == 3 ? 3 * u[k] + near(random) : far(random) >> 4;  // nearly parallel: rounding hides the sign
            b[k] = a[k] + u[k], c[k] = a[k] + v[k], d[k] = a[k] + s * u[k] + t * v[k] + (i % 2 ? near(random) : 0);
        }
        const int expected = plane_by_integers(a, b, c, d);
        flat += expected == 0;
        CHECK(plane(a, b, c, d) == expected);
        CHECK(plane(b, c, a, d) == expected);
        CHECK(plane(b, a, c, d) == -expected);
        CHECK(plane(a, b, d, c) == -expected);
    }
    CHECK(flat >= 10000);
}

}  // namespace fracslice::mesh
