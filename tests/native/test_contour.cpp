// Surfaces of one brick: closed manifolds whatever the samples, crossings and normals; boxes exactly.
#include <doctest/doctest.h>

#include <map>
#include <random>
#include <utility>

#include "mesh/contour.h"

namespace fracslice::mesh {
namespace {

// A brick of samples; those at its rim are outside.
struct Brick {
    std::array<float, kSamples> values;
    std::array<int32_t, 3> ijk{};
    int32_t index = 0;

    template <class Field>
    explicit Brick(const Field& field) {
        for (int i = 0; i < kSamples; ++i) {
            const int x = i / 64, y = i / 8 % 8, z = i % 8;
            const bool rim = std::min({x, y, z}) == 0 || std::max({x, y, z}) == kSide - 1;
            values[size_t(i)] = rim ? 1.f : float(field(x, y, z));
        }
    }
    Bricks view() const { return {{ijk.data(), 1, &index, {1, 1, 1}}, values.data()}; }
};

// Every directed edge once, and its opposite once; every vertex used.
void check_closed(const Array<int32_t>& triangles, size_t vertices) {
    std::map<std::pair<int32_t, int32_t>, int> edges;
    std::vector<bool> used(vertices);
    for (size_t t = 0; t < triangles.rows; ++t) {
        const int32_t* v = &triangles.data[3 * t];
        for (int k = 0; k < 3; ++k) {
            REQUIRE(v[k] >= 0);
            REQUIRE(size_t(v[k]) < vertices);
            used[size_t(v[k])] = true;
            ++edges[{v[k], v[(k + 1) % 3]}];
        }
    }
    CHECK(std::count(used.begin(), used.end(), true) == int64_t(vertices));
    for (auto [edge, count] : edges) {
        CHECK(count == 1);
        CHECK(edges.count({edge.second, edge.first}) == 1);
    }
}

double volume(const Array<double>& vertices, const Array<int32_t>& triangles) {
    double sum = 0;
    for (size_t t = 0; t < triangles.rows; ++t) {
        Vec3 p[3];
        for (size_t k = 0; k < 3; ++k) std::copy_n(&vertices.data[3 * size_t(triangles.data[3 * t + k])], 3, p[k].data());
        sum += dot(p[0], cross(p[1], p[2])) / 6;
    }
    return sum;
}

Contour contour(const Brick& brick, const std::vector<double>& t, const std::vector<float>& normals) {
    const CellGrid cells(brick.view(), volume::signs_of(brick.view()));
    REQUIRE(cells.vertices() == t.size());
    Contouring made(cells, {0, 1}, {{0, 0, 0}, 1, 1e-3});
    made.advance(2, {0, t.size(), t.size(), t.data(), normals.data(), 1e-3});
    return made.finish();
}

}  // namespace

TEST_CASE("marching cubes: closed for random samples") {
    std::mt19937 random(1);
    std::normal_distribution<float> normal;
    for (int i = 0; i < 50; ++i) {
        const Brick brick([&](int, int, int) { return normal(random); });
        const Surface surface = marching_cubes(brick.view(), {{0, 0, 0}, 1, 1e-3});
        CHECK(surface.triangles.rows > 100);
        check_closed(surface.triangles, surface.vertices.rows);
        CHECK(volume(surface.vertices, surface.triangles) > 0);
    }
}

TEST_CASE("contouring: closed for random crossings and normals, whether they make features or not") {
    std::mt19937 random(2);
    std::normal_distribution<float> normal;
    std::uniform_real_distribution<double> share(0, 1);
    size_t features = 0;
    for (int i = 0; i < 50; ++i) {
        const float bulk = float(i % 3) - 1;  // sparse, mixed and dense ones
        const Brick brick([&](int x, int y, int z) { return normal(random) + bulk * (0.3f * float(x + y + z) - 3); });
        const CellGrid cells(brick.view(), volume::signs_of(brick.view()));
        const size_t n = cells.vertices();
        std::vector<double> t(n);
        std::vector<float> normals(3 * n);
        for (size_t k = 0; k < n; ++k) {
            t[k] = share(random);
            Vec3 v = {normal(random), normal(random), normal(random)};
            v = 1 / std::sqrt(dot(v, v)) * v;
            for (size_t axis = 0; axis < 3; ++axis) normals[axis * n + k] = float(v[axis]);
        }
        const Contour surface = contour(brick, t, normals);
        features += surface.vertices.rows - surface.crossings;
        CHECK(surface.crossings == n);
        check_closed(surface.triangles, surface.vertices.rows);
    }
    CHECK(features > 1000);
}

TEST_CASE("contouring: a box has its edges and corners, and its volume") {
    const Vec3 low = {1.25, 2.5, 1.75}, high = {5.5, 5.125, 4.25};
    const Brick brick([&](int x, int y, int z) {
        const Vec3 p = {double(x), double(y), double(z)};
        double most = -10;
        for (size_t k = 0; k < 3; ++k) most = std::max({most, low[k] - p[k], p[k] - high[k]});
        return most;
    });
    const CellGrid cells(brick.view(), volume::signs_of(brick.view()));
    const size_t n = cells.vertices();
    std::vector<double> t(n);
    std::vector<float> normals(3 * n);
    cells.for_each_own_edge(0, [&](const CellEdge& edge) {
        const size_t axis = edge.axis;
        const bool lower = edge.lower[axis] < low[axis];
        t[edge.vertex] = (lower ? low : high)[axis] - edge.lower[axis];
        normals[axis * n + edge.vertex] = lower ? -1.f : 1.f;
    });
    const Contour surface = contour(brick, t, normals);
    check_closed(surface.triangles, surface.vertices.rows);
    CHECK(volume(surface.vertices, surface.triangles) == doctest::Approx(4.25 * 2.625 * 2.5).epsilon(1e-12));
    int corners = 0;
    for (size_t v = 0; v < surface.vertices.rows; ++v) {
        int ends = 0;
        for (size_t k = 0; k < 3; ++k) ends += surface.vertices.data[3 * v + k] == low[k] || surface.vertices.data[3 * v + k] == high[k];
        corners += ends == 3;
    }
    CHECK(corners == 8);
}

TEST_CASE("a sign change that leaves the samples is refused") {
    Brick brick([](int, int, int) { return 1; });
    brick.values[0] = -1;
    CHECK_THROWS_AS(CellGrid(brick.view(), volume::signs_of(brick.view())), std::invalid_argument);
}

TEST_CASE("feature_point: where planes meet, none where they are nearly one") {
    const Crossing x{{0.25, 0.5, 0.5}, {1, 0, 0}}, y{{0.5, 0.625, 0.5}, {0, 1, 0}}, z{{0.5, 0.5, 0.75}, {0, 0, 1}};
    Vec3 point;
    REQUIRE(feature_point(std::array{x, y, z}, 1e-3, point));
    CHECK(point == Vec3{0.25, 0.625, 0.75});
    REQUIRE(feature_point(std::array{x, y}, 1e-3, point));  // an edge: at the crossings' mean along it
    CHECK(point[0] == doctest::Approx(0.25));
    CHECK(point[1] == doctest::Approx(0.625));
    CHECK(point[2] == doctest::Approx(0.5));
    CHECK_FALSE(feature_point(std::array{x, Crossing{{0.25, 0.1, 0.5}, {1, 0, 0}}}, 1e-3, point));
    CHECK_FALSE(feature_point(std::array{x, y, Crossing{{0.5, 0.5, 3}, {0, 0, 1}}}, 1e-3, point));  // far outside the cell
}

TEST_CASE("face_corner: where tangents meet in the face, strictly inside it") {
    const Crossing x{{0.25, 0, 0}, {1, 0, 0}}, y{{0, 0.625, 0}, {0, 1, 0}};
    Vec3 corner;
    REQUIRE(face_corner(x, y, 2, 1e-3, corner));
    CHECK(corner == Vec3{0.25, 0.625, 0});
    CHECK_FALSE(face_corner(x, x, 2, 1e-3, corner));
    REQUIRE(face_corner(x, Crossing{{0, 1.2, 0}, {0, 1, 0}}, 2, 1e-3, corner));
    CHECK(corner[1] == doctest::Approx(1 - 1e-3));
    CHECK_FALSE(face_corner(x, Crossing{{0, 2.2, 0}, {0, 1, 0}}, 2, 1e-3, corner));  // two planes at a right angle are a wedge: a cell away, not more
}

}  // namespace fracslice::mesh
