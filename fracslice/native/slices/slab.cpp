#include "slab.h"

#include <algorithm>
#include <cmath>

#include "evaluate.h"

namespace fracslice {
namespace {

constexpr int kCoarsest = 8;        // tiles along a block of the first level
constexpr int32_t kChunk = 256;     // tiles that stay in a near cache
constexpr double kSteep = 0.7;
constexpr double kAside = 1.25;      // how much farther a likely bound must reach into layers aside
constexpr double kThick = 2.2;       // pixels from the middle of a group to its last layer, at most
constexpr double kSurely = 0.99999;  // squared distances are rounded
constexpr int kMiddle = kTile * kTile / 2 + kTile / 2;

// The middles of the blocks of 4 and of 2 samples of a tile; every other sample.
constexpr uint64_t kFours = 0x0044000000440000, kTwos = 0xAA00AA00AA00AA00, kEven = 0xAA55AA55AA55AA55;

double square(double x) { return x * x; }
double length(double x, double y) { return std::sqrt(x * x + y * y); }

// Squared distances in units of the lesser step, from squared values.
float factor(double bound, const Frame& frame) { return float(kSurely / square(bound * std::min(frame.dx, frame.dy))); }

// Neighbouring layers of at most so little height, in halves of halves.
void group(const std::vector<double>& z, int first, int last, double thick, std::vector<std::pair<int, int>>& groups) {
    int half = (first + last) / 2;
    if (first == last || ((z[last] - z[first]) / 2 <= thick && last - first < int(z.size()) / 2)) {
        groups.push_back({first, last});
    } else {
        group(z, first, half, thick, groups);
        group(z, half + 1, last, thick, groups);
    }
}

}  // namespace

Slab::Slab(std::shared_ptr<Memory> memory, std::shared_ptr<const Field> field, const Bounds& bounds, const Frame& frame,
           std::vector<double> z, int ny, int nx)
    : memory_(std::move(memory)),
      field_(std::move(field)),
      bounds_(bounds),
      frame_(frame),
      z_(std::move(z)),
      discs_(frame.dx, frame.dy),
      farthest_((frame.dx * frame.dx + frame.dy * frame.dy) / 4 / square(std::min(frame.dx, frame.dy))),
      ty_((ny + kTile - 1) / kTile + 2),
      tx_((nx + kTile - 1) / kTile + 2) {
    static_cast<Tiles&>(*this) = memory_->take(z_.size() * ty_ * tx_);
    span.resize(z_.size());
    scale.resize(z_.size());
    group(z_, 0, layers() - 1, kThick * std::min(frame.dx, frame.dy), groups_);
    for (int i = 0; i < kTile * (tx_ - 2); ++i) x_.push_back(float(frame.x0 + frame.dx * i));
    for (int i = 0; i < kTile * (ty_ - 2); ++i) y_.push_back(float(frame.y0 + frame.dy * i));
}

void Slab::sample(int layer) {
    if (group_ < 0) blocks_ = coarse();
    auto [first, last] = *std::find_if(groups_.begin(), groups_.end(), [&](const auto& g) { return layer <= g.second; });
    if (first != group_) columns_ = columns(first, last), group_ = first;
    first_ = int32_t(count());
    begin(layer, z_[layer] - (z_[first] + z_[last]) / 2);
    for (int32_t t = first_, end = int32_t(count()); t < end; t += kChunk) {
        Chunk chunk{layer, t, std::min(t + kChunk, end)};
        probe(chunk, 4, kFours);
        probe(chunk, 2, kTwos);
        if (!bounds_.even) probe(chunk, 1, kEven);
        probe(chunk, 1, kAll);
    }
    mend(layer);
    close(layer);
    corners();
    span[layer] = {first_, int32_t(count())};
    if (bounds_.even) {
        scale[layer] = inside_scale(layer);
    } else {
        settle(layer, edges(true));
        sharpen(layer);
        span[layer][1] = int32_t(count());
    }
}

std::vector<float> Slab::values_at(int layer, const std::vector<Spot>& spots) {
    std::vector<float> found(spots.size());
    auto where = [&](size_t i, double& column, double& row, double& height) {
        column = spots[i].column, row = spots[i].row, height = z_[layer];
    };
    evaluate(spots.size(), where, [&](size_t i, float f) { found[i] = f; });
    return found;
}

// --- top down ------------------------------------------------------------------------------------------------------------
// The blocks of 16 pixels over all layers that are not decided.
std::vector<Slab::Block> Slab::coarse() {
    std::vector<Block> blocks, cut;
    for (int y = 1; y < ty_ - 1; y += kCoarsest)
        for (int x = 1; x < tx_ - 1; x += kCoarsest) blocks.push_back({y, x, kCoarsest, 0, layers() - 1});
    double width = length(frame_.dx, frame_.dy) * kTile / 2, height = (z_.back() - z_[0]) / 2;
    for (int size = kCoarsest; size > 1; size /= 2) {
        cut.clear();
        auto middle = [&](size_t i, double& column, double& row, double& z) {
            column = (blocks[i].x - 1 + size / 2.0) * kTile, row = (blocks[i].y - 1 + size / 2.0) * kTile;
            z = z_[0] + height;
        };
        evaluate(blocks.size(), middle, [&](size_t i, float f) {
            const Block& b = blocks[i];
            if (std::fabs(f) > bounds_.proven * length(width * size, height)) {
                if (f < 0) fill(b);
                return;
            }
            for (int q = 0; q < 4; ++q) {
                int y = b.y + (q >> 1) * size / 2, x = b.x + (q & 1) * size / 2;
                if (y < ty_ - 1 && x < tx_ - 1) cut.push_back({y, x, size / 2, b.first, b.last});
            }
        });
        std::swap(blocks, cut);
    }
    return blocks;
}

void Slab::fill(const Block& block) {
    for (int k = block.first; k <= block.last; ++k)
        for (int y = block.y; y < std::min(block.y + block.size, ty_ - 1); ++y) {
            int32_t* row = &where[(size_t(k) * ty_ + y) * tx_];
            std::fill(row + block.x, row + std::min(block.x + block.size, tx_ - 1), kFull);
        }
}

// The places whose middle, halfway between two layers, leaves open what is around it in them and between.
std::vector<Slab::Column> Slab::columns(int first, int last) {
    double height = (z_[last] - z_[first]) / 2;
    const double margin = bounds_.even ? kAside : 1;
    double reach = margin * length(length(frame_.dx, frame_.dy) * kTile / 2, height);
    std::vector<float> middles(size_t(ty_) * tx_, NAN);
    auto where = [&](size_t i, double& column, double& row, double& z) {
        column = (blocks_[i].x - 0.5) * kTile, row = (blocks_[i].y - 0.5) * kTile, z = z_[first] + height;
    };
    evaluate(blocks_.size(), where, [&](size_t i, float f) { middles[size_t(blocks_[i].y) * tx_ + blocks_[i].x] = f; });
    std::vector<Column> open;
    for (const Block& b : blocks_) {
        const float* f = &middles[size_t(b.y) * tx_ + b.x];
        double outside = bounds_.even ? likely(f) : bounds_.outside;
        if (std::fabs(*f) <= (*f < 0 ? bounds_.inside : outside) * reach)
            open.push_back({b.y, b.x, *f, float(outside)});
        else if (*f < 0)
            fill({b.y, b.x, 1, first, last});
    }
    return open;
}

// The bound for outside values around a middle in an even field: how steep it is between it and those beside it; a part of
// that, for the steepest way is seldom the one to the contour.
double Slab::likely(const float* middle) const {
    double steep[2] = {-1, -1}, step[2] = {kTile * frame_.dx, kTile * frame_.dy};
    for (int axis = 0; axis < 2; ++axis)
        for (int side : {-1, 1}) {
            float other = middle[side * (axis ? tx_ : 1)];
            if (!std::isnan(other)) steep[axis] = std::max(steep[axis], std::fabs(*middle - other) / step[axis]);
        }
    if (steep[0] < 0 || steep[1] < 0) return bounds_.proven;
    return std::min(std::max(kSteep * length(steep[0], steep[1]), bounds_.outside), bounds_.proven);
}

// The tiles of a layer that is `height` above the middles of columns.
void Slab::begin(int layer, double height) {
    float inside_reach = factor(bounds_.inside, frame_), aside = float(square(height)) * factor(1, frame_);
    for (const Column& c : columns_) {
        int32_t t = add(layer, c.y, c.x);
        reach[t] = factor(c.outside, frame_);
        inside[t] = c.value < 0 ? kAll : 0;
        float d2 = c.value * c.value * (c.value < 0 ? inside_reach : reach[t]) - aside;
        if (d2 > 0 && !bounds_.even) decided[t] = discs_(d2, kMiddle);
        if (height == 0) {
            known[t] = uint64_t(1) << kMiddle, decided[t] |= known[t];
            values[t][kMiddle] = c.value;
        }
    }
}

// Evaluates those of the samples `among` that are not decided, each in the middle of a block of `size`, and decides what is
// within their reach; in an even field all of the block or nothing.
void Slab::probe(const Chunk& chunk, int size, uint64_t among) {
    asks_.clear();
    for (int32_t t = chunk.first; t < chunk.last; ++t)
        if (uint64_t samples = among & ~decided[t]) asks_.push_back({t, samples});
    const float inside_reach = factor(bounds_.inside, frame_), farthest = float(size * size * farthest_);
    const int back = size / 2 * (kTile + 1);
    const uint64_t own = uint64_t(1) << back, least_in = size <= bounds_.stop_inside ? block(size) : own,
                   least_out = size <= bounds_.stop_outside ? block(size) : own;
    evaluate(chunk.layer, asks_, [&](const Ask& ask, const float* f) {
        float* kept = values[ask.tile].data();
        const float outside_reach = reach[ask.tile], *begin = f;
        uint64_t negative = 0, reached = 0, within = 0;
        auto reach_of = [&](float v) { return v * v * (v < 0 ? inside_reach : outside_reach); };
        if (bounds_.even) {
            each(ask.samples, [&](int bit) {
                negative |= uint64_t(*f < 0) << bit;
                reached |= uint64_t(reach_of(*f) > farthest) << bit;
                kept[bit] = *f++;
            });
            within = ((reached & negative) >> back) * block(size), reached = (reached >> back) * block(size);
        } else {
            each(ask.samples, [&](int bit) {
                uint64_t near = discs_(reach_of(*f), bit) | (*f < 0 ? least_in : least_out) << (bit - back);
                negative |= uint64_t(*f < 0) << bit;
                within = *f < 0 ? within | near : within & ~near;
                reached |= near;
                kept[bit] = *f++;
            });
        }
        set(ask, negative, reached, within);
        return f - begin;
    });
}

// What is evaluated is so; what is known stays.
void Slab::set(const Ask& ask, uint64_t negative, uint64_t reached, uint64_t within) {
    uint64_t kept = known[ask.tile], implied = reached & ~(kept | ask.samples);
    uint64_t& now = inside[ask.tile];
    now = (now & ~(implied | ask.samples)) | (within & implied) | negative;
    decided[ask.tile] |= reached | ask.samples;
    known[ask.tile] = kept | ask.samples;
}

}  // namespace fracslice
