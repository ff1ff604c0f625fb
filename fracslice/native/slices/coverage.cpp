#include "coverage.h"

#include <algorithm>

namespace fracslice {
namespace {

constexpr int kLanes = 16;  // cells that are rounded at a time

// As `Shape` has it; `more`: what inside values are to be taken times.
void measure(int n, float more, const float* __restrict from_u, const float* __restrict to_u, const float* __restrict from_v,
             const float* __restrict to_v, const float* __restrict product, float* __restrict area) {
    const float less = 1 / more;
    for (int i = 0; i < n; ++i) {
        const float scale = product[i] < 0 ? less : more, p = scale * from_u[i], q = scale * from_v[i];
        const float u = p / (p - to_u[i]), v = q / (q - to_v[i]);
        const float size = std::abs(product[i]);
        area[i] = (size - product[i]) + product[i] * u * v + (0.5f - size) * (u + v);
    }
}

// Parts of pixels as shares of 255, and their sum; n rounded up to whole lanes.
double round(int n, const float* __restrict area, uint8_t* __restrict level) {
    double sum = 0;
    for (int i = 0; i < n; i += kLanes) {
        float lanes = 0;
        for (int lane = 0; lane < kLanes; ++lane) level[i + lane] = uint8_t(int(255 * area[i + lane] + 0.5f));
        for (int lane = 0; lane < kLanes; ++lane) lanes += area[i + lane];
        sum += lanes;
    }
    return sum;
}

}  // namespace

void Coverage::grow() {
    room_ = 2 * room_ + 1024;
    for (Rows<float>* column : {&from_u_, &to_u_, &from_v_, &to_v_, &product_, &area_}) column->resize(room_);
    spot_.resize(room_), level_.resize(room_);
}

void Coverage::push(const Quad& tiles, const Corners& given, uint64_t word, ptrdiff_t first) {
    if (count_ + 64 + kLanes > room_) grow();
    const Cells cells(slab_, scale_, tiles);
    const Corners corners = given;
    const int32_t* spots = spots_.data();
    float *__restrict from_u = &from_u_[count_], *__restrict to_u = &to_u_[count_], *__restrict from_v = &from_v_[count_],
          *__restrict to_v = &to_v_[count_], *__restrict product = &product_[count_];
    ptrdiff_t* __restrict spot = &spot_[count_];
    int n = 0;
    if (scale_ == 0) {
        each(word, [&](int bit) {
            const Sides s = cells.sides(bit);
            const Shape& shape = kShapes[corners.signs(bit)];
            const float u = shape.u.share(s), v = shape.v.share(s);
            from_u[n] = u, to_u[n] = u - 1, from_v[n] = v, to_v[n] = v - 1, product[n] = shape.product;
            spot[n++] = first + spots[bit];
        });
    } else {
        const float* samples = cells.samples();
        each(word, [&](int bit) {
            const Shape& shape = kShapes[corners.signs(bit)];
            const float* f = samples + Cells::place(bit);
            from_u[n] = f[shape.u.from], to_u[n] = f[shape.u.to];
            from_v[n] = f[shape.v.from], to_v[n] = f[shape.v.to], product[n] = shape.product;
            spot[n++] = first + spots[bit];
        });
    }
    const uint64_t sharp = slab_.sharp[tiles.own], rare = (corners.alternating() | sharp) & word;
    each(rare, [&](int bit) {
        const int at = count_ + __builtin_popcountll(word & ((uint64_t(1) << bit) - 1));
        rare_.push_back({at, slab_.sharpened(tiles.own, bit, cells.area(bit, corners.signs(bit)))});
    });
    count_ += n;
}

double Coverage::show(const uint8_t* levels, uint8_t* picture) {
    const int n = count_;
    count_ = 0;
    if (!n) return 0;
    measure(n, scale_ == 0 ? 1 : scale_, from_u_.data(), to_u_.data(), from_v_.data(), to_v_.data(), product_.data(),
            area_.data());
    for (const Rare& r : rare_) area_[r.at] = r.area;
    rare_.clear();
    std::fill_n(&area_[n], kLanes, 0.f);
    const double sum = round(n, area_.data(), level_.data());
    const ptrdiff_t* spot = spot_.data();
    const uint8_t* level = level_.data();
    for (int i = 0; i < n; ++i) picture[spot[i]] = levels[level[i]];
    return sum;
}

}  // namespace fracslice
