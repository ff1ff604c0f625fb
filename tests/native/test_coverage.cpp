// Coverage of pixels by boxes and discs, and runs of solid pixels.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "slices/slab.h"
#include "slices/marching_squares.h"

namespace fracslice::slices {
namespace {

template <class Distance>
struct Formula : Field {
    explicit Formula(Distance distance) : distance(distance) {}
    void values(const float* x, const float* y, const float* z, float* f, size_t n) const override {
        for (size_t i = 0; i < n; ++i) f[i] = float(distance(x[i], y[i], z[i]));
    }
    Distance distance;
};

// One layer of pixels of size 1, `side` along each side.
template <class Distance>
struct Layer {
    FieldSlab slab;
    int side;

    Layer(Distance distance, int side)
        : slab(std::make_shared<Memory>(), std::make_shared<Formula<Distance>>(distance), {1, 1, 1, false}, {0, 0, 1, 1}, {0.0},
               side + 1, side + 1),
          side(side) {
        slab.sample(0);
    }
    Painted paint(std::vector<uint8_t>& image) const {
        image.assign(size_t(side * side), 0);
        return slices::paint(slab, {image.data(), side, side, side, 1});
    }
};

double overlap(double low, double high, int pixel) { return std::max(0.0, std::min(high, pixel + 1.0) - std::max(low, double(pixel))); }

}  // namespace

TEST_CASE("a box that is not aligned with pixels: their exact shares") {
    constexpr double low[] = {5.25, 9.5}, high[] = {26.625, 20.125};
    const auto box = [&](float x, float y, float) {
        return std::max({low[0] - x, x - high[0], low[1] - y, y - high[1]});
    };
    const Layer<decltype(box)> layer(box, 40);
    std::vector<uint8_t> image;
    const Painted painted = layer.paint(image);
    CHECK(painted.area == doctest::Approx((high[0] - low[0]) * (high[1] - low[1])).epsilon(1e-4));
    int cut = 0;
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 40; ++x) {
            const double share = overlap(low[0], high[0], x) * overlap(low[1], high[1], y);
            CHECK(std::abs(image[size_t(40 * y + x)] - 255 * share) <= 1);
            cut += share > 0 && share < 1;
        }
    }
    CHECK(painted.partly == cut);

    // Solid runs are the pixels of at least half of which is inside.
    const SolidRuns solid_rows = solid_runs(layer.slab, 40, 40);
    REQUIRE(solid_rows.rows.size() == 41);
    std::vector<uint8_t> solid(1600, 0);
    for (size_t y = 0; y < 40; ++y) {
        for (int32_t r = solid_rows.rows[y]; r < solid_rows.rows[y + 1]; ++r) {
            for (int32_t x = solid_rows.runs[size_t(r)][0]; x < solid_rows.runs[size_t(r)][1]; ++x) solid[40 * y + size_t(x)] = 1;
        }
    }
    for (size_t i = 0; i < solid.size(); ++i) CHECK(bool(solid[i]) == (image[i] >= 128));
    CHECK(solid_rows.painted.area == doctest::Approx(painted.area));
}

TEST_CASE("discs of many radii: the area, and each pixel's share") {
    for (double radius : {1.6, 2.3, 7.7, 15.2}) {
        const double cx = 20.3, cy = 19.6;
        const auto disc = [&](float x, float y, float) { return std::sqrt((x - cx) * (x - cx) + (y - cy) * (y - cy)) - radius; };
        const Layer<decltype(disc)> layer(disc, 40);
        std::vector<uint8_t> image;
        CHECK(layer.paint(image).area == doctest::Approx(std::numbers::pi * radius * radius).epsilon(4e-3));
        constexpr int fine = 16;
        for (int y = 0; y < 40; ++y) {
            for (int x = 0; x < 40; ++x) {
                int inside = 0;
                for (int i = 0; i < fine * fine; ++i) {
                    inside += disc(float(x + (i % fine + 0.5) / fine), float(y + (i / fine + 0.5) / fine), 0) < 0;
                }
                CHECK(std::abs(image[size_t(40 * y + x)] / 255.0 - double(inside) / (fine * fine)) < 0.03);
            }
        }
    }
}

TEST_CASE("crossings follow each other around the inside") {
    const auto disc = [](float x, float y, float) { return std::hypot(x - 20.3f, y - 19.6f) - 7; };
    const Layer<decltype(disc)> layer(disc, 40);
    const std::vector<Crossing> edges = crossings(layer.slab).edges;
    size_t length = 0;
    for (int32_t i = 0; length == 0 || i != 0; i = edges[size_t(i)].following) REQUIRE(++length <= edges.size());
    CHECK(length == edges.size());
}

TEST_CASE("a solid at the rim is refused") {
    const auto half = [](float x, float, float) { return x - 20.5f; };
    CHECK_THROWS_AS(Layer<decltype(half)>(half, 40), std::domain_error);
}

TEST_CASE("words of 64 signs: shifts, transposition, mirroring, halves") {
    const uint64_t word = 0x9E3779B97F4A7C15, beside = 0xC2B2AE3D27D4EB4F;
    auto at = [](uint64_t w, int row, int column) { return int(w >> (8 * row + column) & 1); };
    for (int row = 0; row < 8; ++row) {
        for (int column = 0; column < 8; ++column) {
            CHECK(at(rights(word, beside), row, column) == (column < 7 ? at(word, row, column + 1) : at(beside, row, 0)));
            CHECK(at(lefts(word, beside), row, column) == (column > 0 ? at(word, row, column - 1) : at(beside, row, 7)));
            CHECK(at(uppers(word, beside), row, column) == (row < 7 ? at(word, row + 1, column) : at(beside, 0, column)));
            CHECK(at(lowers(word, beside), row, column) == (row > 0 ? at(word, row - 1, column) : at(beside, 7, column)));
            CHECK(at(transposed(word), row, column) == at(word, column, row));
            CHECK(at(mirrored(word), row, column) == at(word, row, 7 - column));
        }
    }
    CHECK(doubled(halved(doubled(0x05A0F30C))) == doubled(0x05A0F30C));
}

}  // namespace fracslice::slices
