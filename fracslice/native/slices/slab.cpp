#include "slab.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <stdexcept>

#include "avx512.h"

namespace fracslice::slices {

void Tiles::push(const Place& at, uint64_t signs) {
    place.push_back(at), beside.emplace_back(), inside.push_back(signs), known.push_back(0), sharp.push_back(0);
    values.emplace_back();
}

void Tiles::grow(size_t n) {
    const size_t more = count() + n;
    if (more > place.capacity()) {
        const size_t capacity = more + more / 2;
        place.reserve(capacity), beside.reserve(capacity), inside.reserve(capacity), known.reserve(capacity);
        sharp.reserve(capacity), values.reserve(capacity);
    }
    place.resize(more), beside.resize(more), inside.resize(more), known.resize(more), sharp.resize(more);
    values.resize(more);
}

void Tiles::clear(size_t places) {
    where.assign(places, kEmpty);
    cut(0);
    push({0, 0, kFull}, kAll);
    push({0, 0, kEmpty}, 0);
    values[kFull].fill(0), values[kEmpty].fill(0);
}

void Tiles::cut(size_t n) {
    place.resize(n), beside.resize(n), inside.resize(n), known.resize(n), sharp.resize(n), values.resize(n);
    cross.clear(), tips.clear();
}

void Tiles::drop(size_t first, int columns) {
    for (size_t t = first; t < count(); ++t) where[size_t(place[t].y) * columns + place[t].x] = place[t].otherwise;
    cut(first);
}

Tiles Memory::take(size_t places) {
    Tiles tiles;
    {
        std::lock_guard<std::mutex> lock(mutex_);
        free_.reserve(free_.size() + lent_ + 1);
        if (!free_.empty()) {
            tiles = std::move(free_.back());
            free_.pop_back();
        }
        ++lent_;
    }
    tiles.clear(places);
    return tiles;
}

void Memory::give(Tiles&& tiles) noexcept {
    std::lock_guard<std::mutex> lock(mutex_);
    free_.push_back(std::move(tiles));
    --lent_;
}

Discs::Discs(double dx, double dy, double aside) {
    double unit = std::min(dx, dy);
    for (int d2 = 0; d2 <= kMost; ++d2)
        for (int bit = 0; bit < 64; ++bit) {
            uint64_t word = 0;
            for (int row = 0; row < kTile; ++row) {
                double down = (row - (bit >> 3) - aside) * dy / unit, left = d2 - down * down;
                if (left < 0) continue;
                double column = (bit & 7) + aside, wide = std::sqrt(left) * unit / dx;
                int from = std::max(int(std::ceil(column - wide)), 0), to = std::min(int(std::floor(column + wide)), kTile - 1);
                if (from <= to) word |= ((uint64_t(2) << to) - (uint64_t(1) << from)) << kTile * row;
            }
            discs_[d2][bit] = word;
        }
}

namespace {

void gather_each(std::span<const Ask> asks, const Tiles& tiles, const float* x, const float* y, float* to_x, float* to_y) {
    for (const Ask& ask : asks) {
        const Place& p = tiles.place[ask.tile];
        const float *columns = x + kTile * (p.x - 1), *rows = y + kTile * (p.y - 1);
        each(ask.samples, [&](int bit) { *to_x++ = columns[bit & 7], *to_y++ = rows[bit >> 3]; });
    }
}

void scatter_each(std::span<const Ask> asks, const float* f, const Rim* rim, Tiles& tiles, Signs* result) {
    for (size_t i = 0; i < asks.size(); ++i) {
        float* kept = tiles.values[asks[i].tile].data();
        Signs all{};
        const float factors[] = {rim ? rim->outside[asks[i].tile] : 0, rim ? rim->inside : 0};
        each(asks[i].samples, [&](int bit) {
            const float v = *f++;
            const bool negative = v < 0;
            all.negative |= uint64_t(negative) << bit;
            kept[bit] = v;
            if (!rim) return;
            const float scaled = v * v * factors[negative];
            all.beyond |= uint64_t(scaled > rim->least) << bit;
            all.calm |= uint64_t(negative | (scaled > rim->calm)) << bit;
        });
        result[i] = all;
    }
}

#if defined(FRACSLICE_WIDE)
// With AVX-512 a list of samples is never walked one by one, which would take longer than the field of many.

// Sixteen samples at a time, the chosen ones first brought together.
FRACSLICE_WIDE void gather_wide(std::span<const Ask> asks, const Tiles& tiles, const float* x, const float* y, float* to_x,
                                float* to_y) {
    for (const Ask& ask : asks) {
        const Place& p = tiles.place[ask.tile];
        const __m512 columns = _mm512_castps256_ps512(_mm256_loadu_ps(x + kTile * (p.x - 1)));
        const __m512 rows = _mm512_castps256_ps512(_mm256_loadu_ps(y + kTile * (p.y - 1)));
        const SetBits bits(ask.samples);
        for (int at = 0; at < bits.count; at += 16) {
            const __m512i bit = bits.sixteen(at);
            const __m512i column = _mm512_and_si512(bit, _mm512_set1_epi32(7)), row = _mm512_maskz_srli_epi32(0xFFFF, bit, 3);
            _mm512_storeu_ps(to_x + at, _mm512_maskz_permutexvar_ps(0xFFFF, column, columns));
            _mm512_storeu_ps(to_y + at, _mm512_maskz_permutexvar_ps(0xFFFF, row, rows));
        }
        to_x += bits.count, to_y += bits.count;
    }
}

// How many samples of a word lie before its quarter q.
FRACSLICE_WIDE inline int64_t before(uint64_t word, int q) { return _mm_popcnt_u64(word & ((uint64_t(1) << 16 * q) - 1)); }

template <bool kBeyond>
FRACSLICE_WIDE void scatter_wide(std::span<const Ask> asks, const float* f, const Rim* rim, Tiles& tiles, Signs* result) {
    const __m512 inside = _mm512_set1_ps(kBeyond ? rim->inside : 0);
    const __m512 least = _mm512_set1_ps(kBeyond ? rim->least : 0), calm = _mm512_set1_ps(kBeyond ? rim->calm : 0);
    for (size_t i = 0; i < asks.size(); ++i) {
        const uint64_t samples = asks[i].samples;
        const int64_t count = _mm_popcnt_u64(samples);
        float* kept = tiles.values[asks[i].tile].data();
        for (int q = 0; q < 4; ++q) {
            const __mmask16 chosen = __mmask16(samples >> 16 * q);
            const __m512 v = _mm512_loadu_ps(f + before(samples, q));
            _mm512_mask_storeu_ps(kept + 16 * q, chosen, _mm512_maskz_expand_ps(chosen, v));
        }
        const __m512 outside = _mm512_set1_ps(kBeyond ? rim->outside[asks[i].tile] : 0);
        uint64_t negative = 0, beyond = 0, enough = 0;
        for (int64_t at = 0; at < count; at += 16) {
            const __m512 v = _mm512_loadu_ps(f + at);
            const __mmask16 below = _mm512_cmp_ps_mask(v, _mm512_setzero_ps(), _CMP_LT_OQ);
            negative |= uint64_t(below) << at;
            if (!kBeyond) continue;
            const __m512 scaled = _mm512_mul_ps(_mm512_mul_ps(v, v), _mm512_mask_blend_ps(below, outside, inside));
            beyond |= uint64_t(_mm512_cmp_ps_mask(scaled, least, _CMP_GT_OQ)) << at;
            enough |= uint64_t(__mmask16(below | _mm512_cmp_ps_mask(scaled, calm, _CMP_GT_OQ))) << at;
        }
        result[i] = {_pdep_u64(negative, samples), _pdep_u64(beyond, samples), _pdep_u64(enough, samples)};
        f += count;
    }
}

#endif

}  // namespace

bool has_wide() {
#if defined(FRACSLICE_WIDE)
    return !std::getenv("FRACSLICE_PORTABLE") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vbmi") &&
           __builtin_cpu_supports("avx512vbmi2") && __builtin_cpu_supports("bmi2");
#else
    return false;
#endif
}

void gather(std::span<const Ask> asks, const Tiles& tiles, const float* x, const float* y, float* to_x, float* to_y) {
#if defined(FRACSLICE_WIDE)
    if (kWide) return gather_wide(asks, tiles, x, y, to_x, to_y);
#endif
    gather_each(asks, tiles, x, y, to_x, to_y);
}

void scatter(std::span<const Ask> asks, const float* f, const Rim* rim, Tiles& tiles, Signs* result) {
#if defined(FRACSLICE_WIDE)
    if (kWide) return (rim ? scatter_wide<true> : scatter_wide<false>)(asks, f, rim, tiles, result);
#endif
    scatter_each(asks, f, rim, tiles, result);
}

namespace {

constexpr int kCoarsest = 8;        // tiles along a block of the first level
constexpr double kSteep = 0.7;
constexpr double kHigh = 0.5, kDeep = 0.1;  // shares of the proven bound for blocks of 16 pixels of an escape-time field, outside and inside
// Of a group of layers and of a pair: how much farther a likely bound must reach into them, and how many pixels it is from
// their middle to the last one, at most.
constexpr double kAside = 1.4, kThick = 2.2, kBeside = 1.2, kThin = 0.8;
constexpr double kMiddle = (kTile + 1) / 2.0;  // from the next tile's first sample back to a tile's middle

// The four blocks of 4.
constexpr uint64_t kQuarters[] = {block(4), block(4) << 4, block(4) << 32, block(4) << 36};

// Places that are full: few, so that a call of `memset` would take longer.
#if defined(__GNUC__) && !defined(__clang__)
__attribute__((optimize("no-tree-loop-distribute-patterns")))
#endif
void fill(int32_t* place, int n) {
    for (int i = 0; i < n; ++i) place[i] = kFull;
}

double square(double x) { return x * x; }
double length(double x, double y) { return std::sqrt(x * x + y * y); }

// Neighbouring layers of at most so little height, in halves of halves.
void group(const std::vector<double>& z, int first, int last, double thick, std::vector<std::array<int, 2>>& groups) {
    int half = (first + last) / 2;
    if (first == last || ((z[last] - z[first]) / 2 <= thick && last - first < int(z.size()) / 2)) {
        groups.push_back({first, last});
    } else {
        group(z, first, half, thick, groups);
        group(z, half + 1, last, thick, groups);
    }
}

// The bound for outside values around the middle of a tile in an escape-time field: how steep it is between it and those beside it, a
// part of that, for the steepest way is seldom the one to the contour; the proven one where none are beside it.
class Likely {
 public:
    Likely(const ProbeBounds& bounds, const Frame& frame, int columns)
        : row_(columns), across_(float(kSteep / (kTile * frame.dx))), along_(float(kSteep / (kTile * frame.dy))),
          least_(float(bounds.outside)), most_(float(bounds.proven)) {}
    float operator()(const float* middle) const {
        const float x = across_ * most(middle, 1), y = along_ * most(middle, row_), steep = std::sqrt(x * x + y * y);
        return ((x > 0) & (y > 0) & (steep < most_)) ? std::max(steep, least_) : most_;
    }

 private:
    static float step(float f) { return f == f ? std::fabs(f) : 0; }
    static float most(const float* f, ptrdiff_t to) { return std::max(step(*f - f[-to]), step(*f - f[to])); }

    ptrdiff_t row_;  // from a middle to the one above
    float across_, along_, least_, most_;
};

}  // namespace

Slab::Slab(std::shared_ptr<Memory> memory, const Frame& frame, std::vector<double> z, int ny, int nx)
    : memory_(std::move(memory)), frame_(frame), z_(std::move(z)), ty_((ny + kTile - 1) / kTile + 2), tx_((nx + kTile - 1) / kTile + 2) {
    static_cast<Tiles&>(*this) = memory_->take(size_t(ty_) * tx_);
}

void Slab::begin(int layer) {
    if (layer < 0 || layer >= layers()) throw std::out_of_range("a slab has no such layer");
    layer_ = layer;
}

int32_t Slab::add(int y, int x) {
    int32_t* here = &where[size_t(y) * tx_ + x];
    push({y, x, *here}, inside[*here]);
    *here = int32_t(count() - 1);
    beside.back() = {here[1], here[-1], here[tx_], here[-tx_]};
    for (int side = 0; side < 4; ++side) beside[beside.back()[side]][side ^ 1] = *here;
    return *here;
}

FieldSlab::FieldSlab(std::shared_ptr<Memory> memory, std::shared_ptr<const Field> field, const ProbeBounds& bounds,
                     const Frame& frame, std::vector<double> z, int ny, int nx)
    : Slab(std::move(memory), frame, std::move(z), ny, nx),
      field_(std::move(field)),
      bounds_(bounds),
      diagonal_((square(frame.dx) + square(frame.dy)) / square(std::min(frame.dx, frame.dy))) {
    group(z_, 0, layers() - 1, kThick * std::min(frame.dx, frame.dy), groups_);
    group(z_, 0, layers() - 1, kThin * std::min(frame.dx, frame.dy), pairs_);
    if (!bounds_.escape_time_only) discs_.emplace(frame.dx, frame.dy, 0), centres_.emplace(frame.dx, frame.dy, 0.5);
    for (int i = 0; i < kTile * (tx_ - 2); ++i) x_.push_back(float(frame.x0 + frame.dx * i));
    for (int i = 0; i < kTile * (ty_ - 2); ++i) y_.push_back(float(frame.y0 + frame.dy * i));
}

void FieldSlab::sample(int layer) {
    begin(layer);
    auto of = [&](const auto& groups) { return *std::find_if(groups.begin(), groups.end(), [&](auto& g) { return layer <= g[1]; }); };
    const auto group = of(groups_), pair = of(pairs_);
    if (pair[0] != pair_) {
        drop(kTiles, tx_), pair_ = -1;
        if (group_ < 0) blocks_ = coarse();
        if (group[0] != group_) columns(group[0], group[1]), torn_.reset(), group_ = group[0];
        quarter((z_[pair[0]] + z_[pair[1]]) / 2);
        open((z_[pair[1]] - z_[pair[0]]) / 2);
        pair_ = pair[0];
    }
    reopen();
    probe();
    mend();
    close();
    corners();
    if (bounds_.escape_time_only) {
        scale_ = inside_scale();
    } else {
        project(edges());
        sharpen();
    }
}

std::vector<float> FieldSlab::values_at(const std::vector<Spot>& spots) {
    std::vector<float> result(spots.size());
    auto where = [&](size_t i, float& x, float& y, float& z) {
        x = float(frame_.x0 + frame_.dx * spots[i].column), y = float(frame_.y0 + frame_.dy * spots[i].row), z = float(z_[layer_]);
    };
    evaluate(spots.size(), where, [&](size_t i, float f) { result[i] = f; });
    return result;
}

// --- top down ------------------------------------------------------------------------------------------------------------
// The blocks of 16 pixels over all layers that are not decided.
std::vector<FieldSlab::Block> FieldSlab::coarse() {
    std::vector<Block> blocks, cut;
    for (int y = 1; y < ty_ - 1; y += kCoarsest)
        for (int x = 1; x < tx_ - 1; x += kCoarsest) blocks.push_back({y, x, kCoarsest});
    double width = length(frame_.dx, frame_.dy) * kTile / 2, height = (z_.back() - z_[0]) / 2;
    for (int size = kCoarsest; size > 1; size /= 2) {
        const double rim = bounds_.proven * length(width * size, height);
        const bool likely = bounds_.escape_time_only && size == 2;
        const double outside_rim = likely ? kHigh * rim : rim, inside_rim = likely ? kDeep * rim : rim;
        cut.clear(), cut.reserve(4 * blocks.size());
        auto middle = [&](size_t i, float& x, float& y, float& z) {
            x = float(frame_.x0 + frame_.dx * kTile * (blocks[i].x - 1 + size / 2.0));
            y = float(frame_.y0 + frame_.dy * kTile * (blocks[i].y - 1 + size / 2.0)), z = float(z_[0] + height);
        };
        evaluate(blocks.size(), middle, [&](size_t i, float f) {
            const Block& b = blocks[i];
            if (f > outside_rim) return;
            if (-f > inside_rim) return fill(b);
            for (int q = 0; q < 4; ++q) {
                int y = b.y + (q >> 1) * size / 2, x = b.x + (q & 1) * size / 2;
                if (y < ty_ - 1 && x < tx_ - 1) cut.push_back({y, x, size / 2});
            }
        });
        std::swap(blocks, cut);
    }
    return blocks;
}

void FieldSlab::fill(const Block& block) {
    const int last = std::min(block.y + block.size, ty_ - 1), n = std::min(block.size, tx_ - 1 - block.x);
    for (int y = block.y; y < last; ++y) slices::fill(&where[size_t(y) * tx_ + block.x], n);
}

// The places whose middle, halfway between two layers, does not decide the signs around it in and between these layers.
void FieldSlab::columns(int first, int last) {
    double height = (z_[last] - z_[first]) / 2;
    const double margin = bounds_.escape_time_only ? kAside : 1;
    double reach = margin * length(length(frame_.dx, frame_.dy) * (kTile - 1) / 2, height);
    middles_.resize(size_t(ty_) * tx_, NAN);
    auto middle = [&](const Block& b) { return &middles_[size_t(b.y) * tx_ + b.x]; };
    const float between = float(z_[first] + height);
    auto where = [&](size_t i, float& x, float& y, float& z) {
        x = float(frame_.x0 + frame_.dx * (kTile * blocks_[i].x - kMiddle));
        y = float(frame_.y0 + frame_.dy * (kTile * blocks_[i].y - kMiddle)), z = between;
    };
    evaluate(blocks_.size(), where, [&](size_t i, float f) { *middle(blocks_[i]) = f; });
    const Likely likely(bounds_, frame_, tx_);
    columns_.resize(blocks_.size());
    size_t n = 0;
    for (const Block& b : blocks_) {
        const float f = *middle(b);
        const bool full = -f > bounds_.inside * reach;
        this->where[size_t(b.y) * tx_ + b.x] = full ? kFull : kEmpty;
        const float outside = bounds_.escape_time_only ? likely(middle(b)) : float(bounds_.outside);
        columns_[n] = {b.y, b.x, f, outside};
        n += !full & (f <= double(outside) * reach);
    }
    columns_.resize(n);
    for (Column& c : columns_) c.reach = factor(c.reach, frame_);  // so far the bound, for most were not open
    for (const Block& b : blocks_) *middle(b) = NAN;
}

// The values in the middles of the columns' quarters, at a height.
void FieldSlab::quarter(double height) {
    auto where = [&](size_t i, float& x, float& y, float& z) {
        const Column& c = columns_[i / 4];
        const size_t right = 4 * (i & 1) + 1, above = 2 * (i & 2) + 1;
        x = x_[kTile * (c.x - 1) + right] + float(frame_.dx / 2), y = y_[kTile * (c.y - 1) + above] + float(frame_.dy / 2);
        z = float(height);
    };
    quarters_.resize(columns_.size());
    evaluate(4 * columns_.size(), where, [&](size_t i, float f) { quarters_[i / 4][i & 3] = f; });
}

// The tiles of a pair of layers that are `height` from the middles of quarters; none where all of these say that it is empty,
// unless a tile beside it is taken to be full.
void FieldSlab::open(double height) {
    const float aside = float(square(height)) * factor(1, frame_), least = aside + float(2.25 * diagonal_ * square(bounds_.escape_time_only ? kBeside : 1));
    // A value beyond its rim decides its quarter.
    const float inside_reach = factor(bounds_.inside, frame_);
    grow(columns_.size());
    open_.decided.resize(count()), open_.reach.resize(count());
    size_t t = kTiles;
    for (size_t i = 0; i < columns_.size(); ++i) {
        const Column& c = columns_[i];
        const Four v = quarters_[i], d2 = v * v * (v < 0 ? Four{} + inside_reach : Four{} + c.reach);
        const auto far = d2 > Four{} + least;
        uint64_t now = c.value < 0 ? kAll : 0, reached = 0;
        for (int q = 0; q < 4; ++q) {
            const uint64_t negative = -uint64_t(v[q] < 0);
            uint64_t near = kQuarters[q] & uint64_t(int64_t(far[q]));
            if (!bounds_.escape_time_only && d2[q] > aside) near |= (*centres_)(d2[q] - aside, 9 + 4 * (q & 1) + 16 * (q & 2));
            now = (now & ~near) | (near & negative);
            reached |= near;
        }
        const int32_t* here = spot(c.y, c.x);
        const bool beside_full = (here[1] == kFull) | (here[-1] == kFull) | (here[tx_] == kFull) | (here[-tx_] == kFull);
        place[t] = {c.y, c.x, kEmpty}, inside[t] = now, open_.decided[t] = reached, open_.reach[t] = c.reach;
        t += beside_full | (reached != kAll) | (now != 0);
    }
    cut(t);
    for (t = kTiles; t < count(); ++t) where[size_t(place[t].y) * tx_ + place[t].x] = int32_t(t);
    for (t = kTiles; t < count(); ++t) {
        const int32_t* here = spot(place[t].y, place[t].x);
        beside[t] = {here[1], here[-1], here[tx_], here[-tx_]};
    }
    open_.beside = beside, open_.inside = inside;
}

// A layer of that pair: its tiles as they were opened.
void FieldSlab::reopen() {
    drop(open_.inside.size(), tx_);
    beside = open_.beside, inside = open_.inside, decided_ = open_.decided;
    known.assign(count(), 0), sharp.assign(count(), 0);
}

// One sample of each block of 2 of undecided tiles, and the others, as long as no value reaches them.

namespace {

// One sample of each block of 2, the last; every other sample.
constexpr uint64_t kTwos = 0xAA00AA00AA00AA00, kEven = 0xAA55AA55AA55AA55;
constexpr int kBack = kTile + 1;     // bits from the last sample of a block of 2 to its first
constexpr int32_t kChunk = 256;      // tiles that stay in a near cache
constexpr float kCalm = 0.25f;       // where it is calm, a value need not reach farther than this part of the way

// Of a block of 2 with this last sample, all.
uint64_t blocks(uint64_t last) { return (last >> kBack) * block(2); }

}  // namespace

void FieldSlab::probe() {
    const int32_t end = int32_t(count());
    if (bounds_.escape_time_only) {
        twos();
        calm();
        rest();
    } else {
        for (int32_t t = kTiles; t < end; t += kChunk) {
            const Chunk chunk{t, std::min(t + kChunk, end)};
            probe(chunk, 2, kTwos), probe(chunk, 1, kEven), probe(chunk, 1, kAll);
        }
    }
}

// Those of the samples `among` that are not decided.
void FieldSlab::list(const Chunk& chunk, uint64_t among) {
    asks_.resize(size_t(chunk.last - chunk.first));
    size_t n = 0;
    for (int32_t t = chunk.first; t < chunk.last; ++t) {
        asks_[n] = {t, among & ~decided_[t]};
        n += asks_[n].samples != 0;
    }
    asks_.resize(n);
}

// Evaluates those of the samples `among` that are not decided, each in a block of `size`, and decides the samples within
// their reach.
void FieldSlab::probe(const Chunk& chunk, int size, uint64_t among) {
    list(chunk, among);
    const float inside_reach = factor(bounds_.inside, frame_);
    const int back = size / 2 * kBack;
    const uint64_t own = uint64_t(1) << back;
    evaluate(asks_, nullptr, [&](const Ask& ask, const Signs& result) {
        const float *kept = values[ask.tile].data(), outside_reach = open_.reach[ask.tile];
        uint64_t reached = 0, within = 0;
        each(ask.samples, [&](int bit) {
            const float v = kept[bit], d2 = v * v * (v < 0 ? inside_reach : outside_reach);
            uint64_t near = (*discs_)(d2, bit) | own << (bit - back);
            within = v < 0 ? within | near : within & ~near;
            reached |= near;
        });
        set(ask, result.negative, reached, within);
    });
}

// Sets evaluated samples, and implied ones unless their sign is known.
void FieldSlab::set(const Ask& ask, uint64_t negative, uint64_t reached, uint64_t within) {
    uint64_t kept = known[ask.tile], implied = reached & ~(kept | ask.samples);
    uint64_t& now = inside[ask.tile];
    now = (now & ~(implied | ask.samples)) | (within & implied) | negative;
    decided_[ask.tile] |= reached | ask.samples;
    known[ask.tile] = kept | ask.samples;
}

// --- in escape-time fields ------------------------------------------------------------------------------------------------------
// One sample of each block of 2, which decides all of it or nothing.
void FieldSlab::twos() {
    list({kTiles, int32_t(count())}, kTwos);
    enough_.resize(count());
    const Rim rim{factor(bounds_.inside, frame_), open_.reach.data(), float(diagonal_), float(diagonal_) * kCalm * kCalm};
    evaluate(asks_, &rim, [&](const Ask& ask, const Signs& result) {
        enough_[ask.tile] = blocks(result.calm);
        set(ask, result.negative, blocks(result.beyond), blocks(result.beyond & result.negative));
    });
}

// Decides the blocks of 2 around which, two blocks wide, nothing has the other sign. How near the surface is shows in the signs
// around a sample rather than in its value.
void FieldSlab::calm() {
    const size_t n = count();
    halves_.resize(n), rows_.resize(n);
    const auto* around = beside.data();
    uint32_t *halves = halves_.data(), *rows = rows_.data();
    uint64_t *signs = inside.data(), *decided = decided_.data();
    for (size_t t = 0; t < n; ++t) halves[t] = halved(signs[t]);
    // The four rows of a tile's blocks, between two blocks of those beside it.
    rows[kFull] = ~uint32_t(0), rows[kEmpty] = 0;
    for (size_t t = kTiles; t < n; ++t) {
        const auto [right, left, upper, lower] = around[t];
        rows[t] = (halves[left] >> 2 & 0x03030303) | halves[t] << 2 | (halves[right] & 0x03030303) << 6;
    }
    for (size_t t = kTiles; t < n; ++t) {
        const auto [right, left, upper, lower] = around[t];
        const uint64_t eight = rows[lower] >> 16 | uint64_t(rows[t]) << 16 | uint64_t(rows[upper]) << 48;
        const uint64_t full = doubled(all_of_five(eight)), empty = doubled(all_of_five(~eight)) & enough_[t];
        const uint64_t implied = (full | empty) & ~decided[t];
        signs[t] = (signs[t] & ~implied) | (full & implied);
        decided[t] |= implied;
    }
}

void FieldSlab::rest() {
    list({kTiles, int32_t(count())}, kAll);
    evaluate(asks_, nullptr, [&](const Ask& ask, const Signs& result) { set(ask, result.negative, 0, 0); });
}

// --- Outside in, and inside out: until every edge that the contour crosses has two evaluated ends.

// Opens tiles taken to be full beside tiles taken to be empty, where a bound is wrong; the same in all layers of a group.
void FieldSlab::mend() {
    if (!torn_) torn_ = torn();
    for (const Place& p : *torn_) add(p.y, p.x);
}

std::vector<Place> FieldSlab::torn() const {
    std::vector<Place> result;
    for (int y = 1; y < ty_ - 1; ++y) {
        const int32_t *row = spot(y, 0), *below = row - tx_, *above = row + tx_;
        auto torn = [&](int x) {
            bool beside = (row[x - 1] == kEmpty) | (row[x + 1] == kEmpty) | (below[x] == kEmpty) | (above[x] == kEmpty);
            return (row[x] == kFull) & beside;
        };
        int32_t any = 0;
        for (int x = 1; x < tx_ - 1; ++x) any |= -int32_t(torn(x));
        for (int x = 1; any && x < tx_ - 1; ++x)
            if (torn(x)) result.push_back({y, x, kFull});
    }
    return result;
}

// The samples of a tile that differ from those to their right, left, above and below; and the tiles there.
struct FieldSlab::Differing {
    std::array<int32_t, 4> beside;
    uint64_t words[4];

    Differing(const std::array<int32_t, 4>& beside, const uint64_t* inside, uint64_t s) : beside(beside) {
        words[0] = s ^ rights(s, inside[beside[0]]), words[1] = s ^ lefts(s, inside[beside[1]]);
        words[2] = s ^ uppers(s, inside[beside[2]]), words[3] = s ^ lowers(s, inside[beside[3]]);
    }
    // Those that differ from what has no tile.
    uint64_t open(int side) const {
        constexpr uint64_t faces[] = {kLastColumn, kFirstColumn, kLastRow, kFirstRow};
        return words[side] & faces[side] & -uint64_t(beside[side] < kTiles);
    }
};

// Whether anything is to be done for a tile is hard to foretell: everywhere here lists are written without asking, and what
// does not belong to them is written over.
void FieldSlab::close() {
    std::vector<int32_t> active(count() - kTiles), again;
    std::iota(active.begin(), active.end(), kTiles);
    std::vector<uint8_t> marked;  // tiles that are in `again`, and the two that never are
    Rows<Ask> turned;
    while (!active.empty()) {
        asks_.clear(), again.clear();
        ask(active, again);
        turned.resize(asks_.size());
        size_t turns = 0;
        evaluate(asks_, nullptr, [&](const Ask& ask, const Signs& result) {
            const uint64_t other = (inside[ask.tile] ^ result.negative) & ask.samples;
            known[ask.tile] |= ask.samples, inside[ask.tile] ^= other;
            turned[turns] = {ask.tile, other};
            turns += other != 0;
        });
        marked.assign(count(), 0);
        marked[kFull] = marked[kEmpty] = 1;
        for (int32_t t : again) marked[t] = 1;
        size_t marks = again.size();
        again.resize(marks + 5 * turns);
        auto mark = [&](bool is, int32_t t) {
            t = is ? t : kFull;
            again[marks] = t, marks += !marked[t], marked[t] = 1;
        };
        for (size_t i = 0; i < turns; ++i) {
            const auto [t, samples] = turned[i];
            const auto [right, left, upper, lower] = beside[t];
            mark(true, t);
            mark(samples & kLastColumn, right), mark(samples & kFirstColumn, left);
            mark(samples & kLastRow, upper), mark(samples & kFirstRow, lower);
        }
        again.resize(marks);
        std::swap(active, again);
    }
    assert(is_closed());
}

bool FieldSlab::is_closed() const {
    for (int32_t t = kTiles; t < int32_t(count()); ++t) {
        const Differing d(beside[t], inside.data(), inside[t]);
        if ((d.words[0] | d.words[1] | d.words[2] | d.words[3]) & ~known[t]) return false;
    }
    return true;
}

// One wave of the closure: the implied samples that differ from a neighbour. Tiles made on the way become active; tiles at
// the rim that reach it are to be looked at again.
void FieldSlab::ask(std::vector<int32_t>& active, std::vector<int32_t>& again) {
    std::vector<int32_t> open;
    for (size_t begin = 0, end; begin < active.size(); begin = end) {
        end = active.size();
        const size_t asked = asks_.size();
        asks_.resize(asked + end - begin), open.resize(end - begin);
        const uint64_t *signs = inside.data(), *evaluated = known.data();
        const auto* around = beside.data();
        const int32_t* tiles = active.data();
        Ask* next = asks_.data() + asked;
        int32_t* opened = open.data();
        for (size_t a = begin; a < end; ++a) {
            const int32_t t = tiles[a];
            const Differing d(around[t], signs, signs[t]);
            const uint64_t samples = (d.words[0] | d.words[1] | d.words[2] | d.words[3]) & ~evaluated[t];
            *next = {t, samples}, next += samples != 0;
            *opened = t, opened += (d.open(0) | d.open(1) | d.open(2) | d.open(3)) != 0;
        }
        asks_.resize(size_t(next - asks_.data()));
        for (const int32_t* t = open.data(); t != opened; ++t) enlarge(*t, active, again);
    }
}

// Makes the tiles beside one that samples in it ask for.
void FieldSlab::enlarge(int32_t t, std::vector<int32_t>& active, std::vector<int32_t>& again) {
    constexpr int dy[] = {0, 0, 1, -1}, dx[] = {1, -1, 0, 0};
    const Differing d(beside[t], inside.data(), inside[t]);
    for (int side = 0; side < 4; ++side) {
        const uint64_t face = d.open(side);
        if (!face) continue;
        const int y = place[t].y + dy[side], x = place[t].x + dx[side];
        if (y > 0 && x > 0 && y < ty_ - 1 && x < tx_ - 1)
            active.push_back(add(y, x));
        else if (face & known[t])
            throw std::domain_error("the solid reaches the border of the layers");
        else
            again.push_back(t);
    }
}

// Tiles of which the contour cuts nothing but the last cell, at the corner: the two beside it have its sign there.
void FieldSlab::corners() {
    for (int32_t t = kTiles, n = int32_t(count()); t < n; ++t) {
        const auto [right, left, upper, lower] = beside[t];
        const uint64_t own = inside[t];
        const bool cut = (own ^ inside[left] >> 7) & (own ^ inside[lower] >> 56) & 1;
        if (cut && at(place[t].y - 1, place[t].x - 1) < kTiles) add(place[t].y - 1, place[t].x - 1);
    }
}

// Where a fractal crosses edges.
namespace {

constexpr size_t kFew = 128;
constexpr float kSmallest = 1e6f;  // inside values that large bailouts make
constexpr int32_t kOften = 8, kSeldom = 40, kEnough = 96;  // strides of the tiles looked at, and how many are enough

}  // namespace

// Crossed edges of the layer.
std::vector<FieldSlab::Edge> FieldSlab::edges() const {
    std::vector<Edge> result;
    for (int32_t t = kTiles; t < int32_t(count()); ++t)
        crossed(t, kAll, [&](int number, float first, float second) { result.push_back({t, number, first, second}); });
    return result;
}

// Those of one tile in `step`.
FieldSlab::Middles FieldSlab::middles(int32_t step) const {
    Middles result;
    for (auto* list : {&result.x, &result.y, &result.quotients}) list->reserve(count() - kTiles);
    const float half[2] = {float(frame_.dx / 2), float(frame_.dy / 2)};
    for (int32_t t = kTiles; t < int32_t(count()); t += step) {
        const float *x = &x_[kTile * (place[t].x - 1)], *y = &y_[kTile * (place[t].y - 1)];
        crossed(t, kAll, [&](int number, float first, float second) {
            const bool up = number >> 6;
            result.x.push_back(x[number & 7] + (up ? 0 : half[0])), result.y.push_back(y[number >> 3 & 7] + (up ? half[1] : 0));
            result.quotients.push_back(std::max(first, second) / -std::min(first, second));
        });
    }
    return result;
}

// How many times smaller inside values are than outside ones: the factor with which as many crossings lie before the middle
// of their edge as do in truth. An eighth of the edges is enough to know it, and a fortieth of many.
float FieldSlab::inside_scale() {
    const int32_t tiles = int32_t(count()) - kTiles;
    int32_t step = std::clamp(tiles / kEnough, kOften, kSeldom);
    Middles some = middles(step);
    while (some.x.size() < kFew && step > 1) some = middles(step /= 2);
    if (some.x.empty()) return 1;
    const float height = float(z_[layer_]);
    ptrdiff_t before = 0;
    auto where = [&](size_t i, float& x, float& y, float& z) { x = some.x[i], y = some.y[i], z = height; };
    evaluate(some.x.size(), where, [&](size_t, float f) { before += f < 0; });
    auto chosen = some.quotients.begin() + std::min(before, ptrdiff_t(some.quotients.size()) - 1);
    std::nth_element(some.quotients.begin(), chosen, some.quotients.end());
    return std::clamp(*chosen, 0.125f, kSmallest);
}

}  // namespace fracslice::slices
