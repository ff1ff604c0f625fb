#include "slab.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "bits.h"

namespace fracslice {
namespace {

constexpr int kCoarsest = 8;  // tiles along a block of the first level
constexpr size_t kBatch = 1024;
constexpr double kSteep = 0.7;

// The middles of the blocks of 8, 4 and 2 samples of a tile.
constexpr uint64_t middles(int size) {
    uint64_t word = 0;
    for (int y = size / 2; y < kTile; y += size)
        for (int x = size / 2; x < kTile; x += size) word |= uint64_t(1) << (kTile * y + x);
    return word;
}
double length(double x, double y) { return std::sqrt(x * x + y * y); }

constexpr uint64_t kMiddles[9] = {0, 0, middles(2), 0, middles(4), 0, 0, 0, middles(8)};

}  // namespace

Slab::Slab(const Frame& frame, std::vector<double> z, std::vector<int> wanted, int ny, int nx)
    : frame_(frame),
      z_(std::move(z)),
      wanted_(std::move(wanted)),
      ty_((ny + kTile - 1) / kTile + 2),
      tx_((nx + kTile - 1) / kTile + 2),
      where_(z_.size() * ty_ * tx_, kEmpty) {}

void Slab::sample(const Field& field, const Bounds& bounds) {
    span.resize(z_.size());
    std::vector<Block> blocks = coarse(field, bounds);
    // Layer by layer, so that what is worked on stays near.
    for (int k : wanted_) {
        first_ = count();
        tiles(field, bounds, blocks, k);
        for (int size : {8, 4, 2}) finer(field, bounds, size);
        mend(k);
        close(field);
        corners();
        measure(field, bounds, k);
        span[k] = {int32_t(first_), int32_t(count())};
        if (!bounds.even) sharpen(field, k);
        span[k][1] = int32_t(count());
    }
}

// where(i, column, row, z) sets the place of point i on the lattice; take(i, f) gets its value.
template <class Where, class Take>
void Slab::evaluate(const Field& field, size_t n, const Where& where, const Take& take) {
    evaluations += int64_t(n);
    double columns[kBatch], rows[kBatch], heights[kBatch];
    alignas(64) float x[kBatch], y[kBatch], z[kBatch], f[kBatch];
    for (size_t begin = 0; begin < n; begin += kBatch) {
        size_t m = std::min(kBatch, n - begin), padded = (m + 63) / 64 * 64;
        for (size_t i = 0; i < m; ++i) where(begin + i, columns[i], rows[i], heights[i]);
        for (size_t i = 0; i < m; ++i) {
            x[i] = float(frame_.x0 + frame_.dx * columns[i]);
            y[i] = float(frame_.y0 + frame_.dy * rows[i]);
            z[i] = float(heights[i]);
        }
        for (size_t i = m; i < padded; ++i) x[i] = x[0], y[i] = y[0], z[i] = z[0];
        field.values(x, y, z, f, padded);
        // What is not a number counts as outside.
        for (size_t i = 0; i < m; ++i) take(begin + i, std::isnan(f[i]) ? float(frame_.dx) : f[i]);
    }
}

// Of samples 64 * tile + bit.
template <class Take>
void Slab::evaluate(const Field& field, const std::vector<int64_t>& samples, const Take& take) {
    auto where = [&](size_t i, double& column, double& row, double& height) {
        const Place& p = place[samples[i] >> 6];
        column = kTile * (p.x - 1) + (samples[i] & 7), row = kTile * (p.y - 1) + (samples[i] >> 3 & 7), height = z_[p.layer];
    };
    evaluate(field, samples.size(), where, [&](size_t i, float f) {
        size_t t = samples[i] >> 6;
        int bit = samples[i] & 63;
        known[t] |= uint64_t(1) << bit;
        values[t][bit] = f;
        take(t, bit, f);
    });
}

std::vector<float> Slab::values_at(const Field& field, int layer, const std::vector<Spot>& spots) {
    std::vector<float> found(spots.size());
    auto where = [&](size_t i, double& column, double& row, double& height) {
        column = spots[i].column, row = spots[i].row, height = z_[layer];
    };
    evaluate(field, spots.size(), where, [&](size_t i, float f) { found[i] = f; });
    return found;
}

int32_t Slab::add(int layer, int y, int x) {
    int32_t& here = where_[(size_t(layer) * ty_ + y) * tx_ + x];
    inside.push_back(here == kFull ? kAll : 0);
    known.push_back(0);
    sharp.push_back(0);
    values.emplace_back();
    outside_.push_back(0);
    place.push_back({layer, y, x});
    return here = int32_t(place.size() - 1);
}

// --- top down ------------------------------------------------------------------------------------------------------------
std::vector<Slab::Block> Slab::coarse(const Field& field, const Bounds& bounds) {
    std::vector<Block> blocks, cut;
    for (int y = 1; y < ty_ - 1; y += kCoarsest)
        for (int x = 1; x < tx_ - 1; x += kCoarsest) blocks.push_back({y, x, kCoarsest, 0, layers() - 1});
    double width = length(frame_.dx, frame_.dy) * kTile / 2;
    while (!blocks.empty() && blocks[0].size > 0) {
        cut.clear();
        auto middle = [&](size_t i, double& column, double& row, double& height) {
            const Block& b = blocks[i];
            column = (b.x - 1 + b.size / 2.0) * kTile, row = (b.y - 1 + b.size / 2.0) * kTile;
            height = (z_[b.first] + z_[b.last]) / 2;
        };
        evaluate(field, blocks.size(), middle, [&](size_t i, float f) {
            const Block& b = blocks[i];
            if (std::fabs(f) > bounds.proven * length(width * b.size, (z_[b.last] - z_[b.first]) / 2)) {
                if (f < 0) fill(b);
                return;
            }
            if (b.size > 1) {
                int half = b.size / 2;
                for (int q = 0; q < 4; ++q) {
                    int y = b.y + (q >> 1) * half, x = b.x + (q & 1) * half;
                    if (y >= ty_ - 1 || x >= tx_ - 1) continue;
                    int between = half > 1 ? b.last : (b.first + b.last) / 2;
                    cut.push_back({y, x, half, b.first, between});
                    if (between < b.last) cut.push_back({y, x, half, between + 1, b.last});
                }
            } else {
                cut.push_back({b.y, b.x, 0, b.first, b.last});
            }
        });
        std::swap(blocks, cut);
    }
    return blocks;
}

void Slab::fill(const Block& block) {
    for (int k = block.first; k <= block.last; ++k)
        for (int y = block.y; y < std::min(block.y + block.size, ty_ - 1); ++y) {
            int32_t* row = &where_[(size_t(k) * ty_ + y) * tx_];
            std::fill(row + block.x, row + std::min(block.x + block.size, tx_ - 1), kFull);
        }
}

// The middles of the tiles of a layer; a tile is made where its middle leaves open what is in it.
void Slab::tiles(const Field& field, const Bounds& bounds, const std::vector<Block>& blocks, int layer) {
    std::vector<Place> places;
    for (const Block& b : blocks)
        if (b.first <= layer && layer <= b.last) places.push_back({layer, b.y, b.x});
    constexpr int middle = kTile * kTile / 2 + kTile / 2;
    double reach = length(frame_.dx, frame_.dy) * kTile / 2;
    auto where = [&](size_t i, double& column, double& row, double& height) {
        const Place& p = places[i];
        column = (p.x - 0.5) * kTile, row = (p.y - 0.5) * kTile, height = z_[p.layer];
    };
    std::vector<float> middles(size_t(ty_) * tx_, NAN);
    evaluate(field, places.size(), where, [&](size_t i, float f) {
        middles[size_t(places[i].y) * tx_ + places[i].x] = f;
        if (f < 0) where_[(size_t(layer) * ty_ + places[i].y) * tx_ + places[i].x] = kFull;
    });
    for (const Place& p : places) {
        const float* f = &middles[size_t(p.y) * tx_ + p.x];
        double outside = bounds.even ? likely(bounds, f) : bounds.outside;
        if (std::fabs(*f) > (*f < 0 ? bounds.inside : outside) * reach) continue;
        int32_t t = add(layer, p.y, p.x);
        known[t] = uint64_t(1) << middle;
        values[t][middle] = *f;
        outside_[t] = float(outside);
    }
}

// The bound for outside values around a tile's middle in an even field: how steep it is, within the layer, between it and
// those beside it; a part of that, for the steepest way is seldom the one to the contour.
double Slab::likely(const Bounds& bounds, const float* middle) const {
    double steep[2] = {-1, -1}, step[2] = {kTile * frame_.dx, kTile * frame_.dy};
    for (int axis = 0; axis < 2; ++axis)
        for (int side : {-1, 1}) {
            float other = middle[side * (axis ? tx_ : 1)];
            if (!std::isnan(other)) steep[axis] = std::max(steep[axis], std::fabs(*middle - other) / step[axis]);
        }
    if (steep[0] < 0 || steep[1] < 0) return bounds.proven;
    return std::min(std::max(kSteep * length(steep[0], steep[1]), bounds.outside), bounds.proven);
}

// The middles of the quarters of each block of `size` whose own middle decides too little; their signs become the implied
// ones of their quarters.
void Slab::finer(const Field& field, const Bounds& bounds, int size) {
    int half = size / 2, quarter = size / 4;
    double reach = length(frame_.dx, frame_.dy) * size / 2;
    std::vector<int64_t> samples;
    for (size_t t = first_; t < count(); ++t) {
        for (uint64_t probes = known[t] & kMiddles[size]; probes; probes &= probes - 1) {
            int bit = lowest(probes);
            float v = values[t][bit];
            if (v < 0 ? -v > bounds.inside * reach || size <= bounds.stop_inside
                      : v > outside_[t] * reach || size <= bounds.stop_outside)
                continue;
            int first = bit - 9 * (half - quarter);
            for (int p : {first, first + half, first + 8 * half, first + 9 * half})
                if (!(known[t] >> p & 1)) samples.push_back(int64_t(64 * t + p));
        }
    }
    evaluate(field, samples, [&](size_t t, int p, float f) {
        uint64_t block = half > 1 ? block_mask(half, (p >> 3) - quarter, (p & 7) - quarter) & ~known[t] : 0;
        block |= uint64_t(1) << p;
        inside[t] = f < 0 ? inside[t] | block : inside[t] & ~block;
    });
}

// --- outside in, and inside out --------------------------------------------------------------------------------------------
// Tiles said to be full beside ones said to be empty, where a bound is wrong.
void Slab::mend(int layer) {
    for (int y = 1; y < ty_ - 1; ++y)
        for (int x = 1; x < tx_ - 1; ++x)
            if (at(layer, y, x) == kFull && (at(layer, y - 1, x) == kEmpty || at(layer, y + 1, x) == kEmpty ||
                                             at(layer, y, x - 1) == kEmpty || at(layer, y, x + 1) == kEmpty))
                add(layer, y, x);
}

void Slab::close(const Field& field) {
    std::vector<int32_t> active(count() - first_);
    std::iota(active.begin(), active.end(), int32_t(first_));
    std::vector<uint8_t> marked(count() - first_);  // tiles that are in `active`, from the layer's first on
    std::vector<int64_t> samples;
    while (!active.empty()) {
        samples.clear();
        ask(active, marked, samples);
        active.clear();
        evaluate(field, samples, [&](size_t t, int bit, float f) {
            uint64_t mask = uint64_t(1) << bit;
            if ((f < 0) == bool(inside[t] & mask)) return;
            inside[t] ^= mask;
            const Place& p = place[t];
            const int32_t* here = &where_[(size_t(p.layer) * ty_ + p.y) * tx_ + p.x];
            for (int32_t o : {here[0], here[1], here[-1], here[tx_], here[-tx_]})
                if (o >= 0 && !marked[o - first_]) {
                    marked[o - first_] = 1;
                    active.push_back(o);
                }
        });
    }
}

// One wave of the closure: the implied samples that differ from a neighbour. Tiles made on the way become active.
void Slab::ask(std::vector<int32_t>& active, std::vector<uint8_t>& marked, std::vector<int64_t>& samples) {
    constexpr int dy[] = {0, 0, 1, -1}, dx[] = {1, -1, 0, 0};
    constexpr uint64_t faces[] = {kLastColumn, kFirstColumn, kLastRow, kFirstRow};
    for (size_t a = 0; a < active.size(); ++a) {
        int32_t t = active[a];
        marked[t - first_] = 0;
        Place p = place[t];
        uint64_t s = inside[t], differing = 0;
        for (int side = 0; side < 4; ++side) {
            int y = p.y + dy[side], x = p.x + dx[side];
            uint64_t other = word(p.layer, y, x);
            uint64_t d = s ^ (side == 0   ? rights(s, other)
                              : side == 1 ? lefts(s, other)
                              : side == 2 ? uppers(s, other)
                                          : lowers(s, other));
            differing |= d;
            uint64_t face = d & faces[side];
            if (!face || at(p.layer, y, x) >= 0) continue;
            if (y == 0 || x == 0 || y == ty_ - 1 || x == tx_ - 1) {
                if (face & known[t]) throw std::domain_error("the solid reaches the border of the layers");
                continue;
            }
            active.push_back(add(p.layer, y, x));
            marked.push_back(0);
        }
        for (uint64_t need = differing & ~known[t]; need; need &= need - 1) samples.push_back(64 * int64_t(t) + lowest(need));
    }
}

// Tiles of which the contour cuts nothing but the last cell, at the corner.
void Slab::corners() {
    for (size_t t = first_, n = count(); t < n; ++t) {
        Place p = place[t];
        int32_t there = at(p.layer, p.y - 1, p.x - 1);
        if (there < 0 && (there == kFull) != bool(inside[t] & 1)) add(p.layer, p.y - 1, p.x - 1);
    }
}

// --- where edges are crossed -----------------------------------------------------------------------------------------------
void Slab::measure(const Field& field, const Bounds& bounds, int layer) {
    cross.resize(count());
    std::vector<Edge> edges;
    for (size_t t = first_; t < count(); ++t) {
        const Place& p = place[t];
        uint64_t s = inside[t];
        uint64_t words[2] = {s ^ rights(s, word(p.layer, p.y, p.x + 1)), s ^ uppers(s, word(p.layer, p.y + 1, p.x))};
        for (int up = 0; up < 2; ++up)
            for (uint64_t w = words[up]; w; w &= w - 1) {
                int bit = lowest(w);
                float a = values[t][bit], b = value(p, int32_t(t), (bit >> 3) + up, (bit & 7) + 1 - up);
                edges.push_back({int32_t(t), 64 * up + bit, a, b});
            }
    }
    if (bounds.even)
        halve(field, edges);
    else
        settle(field, layer, edges);
}

// Crossings of an even field, by interpolation. Inside values are multiplied by the one factor with which as many crossings
// lie before the middle of their edge as do in truth; an eighth of the edges is enough to know it.
void Slab::halve(const Field& field, const std::vector<Edge>& edges) {
    constexpr size_t few = 1024;
    auto column = [&](const Edge& e) { return kTile * (place[e.tile].x - 1) + (e.number & 7); };
    auto row = [&](const Edge& e) { return kTile * (place[e.tile].y - 1) + (e.number >> 3 & 7); };
    std::vector<Edge> halved;
    for (const Edge& e : edges) {
        uint32_t at = uint32_t(column(e)) * 0x9E3779B1u + uint32_t(row(e)) * 0x85EBCA6Bu;
        if (edges.size() < few || at >> 29 == 0) halved.push_back(e);
    }
    std::vector<float> middle(halved.size());
    auto where = [&](size_t i, double& x, double& y, double& z) {
        const Edge& e = halved[i];
        int up = e.number >> 6;
        x = column(e) + 0.5 * (1 - up), y = row(e) + 0.5 * up, z = z_[place[e.tile].layer];
    };
    evaluate(field, halved.size(), where, [&](size_t i, float f) { middle[i] = f; });
    // The share of the edge from its outer end.
    auto put = [&](const Edge& e, float share) { cross[e.tile][e.number] = share_of(e.first > e.second ? share : 1 - share); };
    float scale = inside_scale(halved, middle);
    for (const Edge& e : edges) put(e, e.out() / (e.out() - scale * e.in()));
    for (size_t i = 0; i < halved.size(); ++i) {
        const Edge& e = halved[i];
        float m = middle[i], in = scale * e.in();
        put(e, m < 0 ? 0.5f * e.out() / (e.out() - scale * m) : 0.5f + 0.5f * m / (m - in));
    }
}

// How many times smaller inside values are than outside ones: by the share of edges whose middle is inside.
float Slab::inside_scale(const std::vector<Edge>& edges, const std::vector<float>& middle) {
    if (edges.empty()) return 1;
    std::vector<float> quotients(edges.size());
    size_t before = 0;
    for (size_t i = 0; i < edges.size(); ++i) {
        quotients[i] = edges[i].out() / -edges[i].in();
        before += middle[i] < 0;
    }
    auto chosen = quotients.begin() + std::ptrdiff_t(std::min(before, edges.size() - 1));
    std::nth_element(quotients.begin(), chosen, quotients.end());
    return std::min(std::max(*chosen, 0.125f), 64.f);
}

}  // namespace fracslice
