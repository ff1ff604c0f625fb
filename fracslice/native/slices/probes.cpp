// One sample of each block of 2 of undecided tiles, and the others, as long as no value reaches them.
#include "slab.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <stdexcept>

namespace fracslice::slices {
namespace {

// One sample of each block of 2, the last; every other sample.
constexpr uint64_t kTwos = 0xAA00AA00AA00AA00, kEven = 0xAA55AA55AA55AA55;
constexpr int kBack = kTile + 1;     // bits from the last sample of a block of 2 to its first
constexpr int32_t kChunk = 256;      // tiles that stay in a near cache
constexpr float kCalm = 0.25f;       // where it is calm, a value need not reach farther than this part of the way

// Of a block of 2 with this last sample, all.
uint64_t blocks(uint64_t last) { return (last >> kBack) * block(2); }

}  // namespace

void Slab::probe() {
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
void Slab::list(const Chunk& chunk, uint64_t among) {
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
void Slab::probe(const Chunk& chunk, int size, uint64_t among) {
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
void Slab::set(const Ask& ask, uint64_t negative, uint64_t reached, uint64_t within) {
    uint64_t kept = known[ask.tile], implied = reached & ~(kept | ask.samples);
    uint64_t& now = inside[ask.tile];
    now = (now & ~(implied | ask.samples)) | (within & implied) | negative;
    decided_[ask.tile] |= reached | ask.samples;
    known[ask.tile] = kept | ask.samples;
}

// --- in escape-time fields ------------------------------------------------------------------------------------------------------
// One sample of each block of 2, which decides all of it or nothing.
void Slab::twos() {
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
void Slab::calm() {
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

void Slab::rest() {
    list({kTiles, int32_t(count())}, kAll);
    evaluate(asks_, nullptr, [&](const Ask& ask, const Signs& result) { set(ask, result.negative, 0, 0); });
}

// --- Outside in, and inside out: until every edge that the contour crosses has two evaluated ends.

int32_t Slab::add(int y, int x) {
    int32_t* here = &where[size_t(y) * tx_ + x];
    push({y, x, *here}, inside[*here]);
    *here = int32_t(count() - 1);
    beside.back() = {here[1], here[-1], here[tx_], here[-tx_]};
    for (int side = 0; side < 4; ++side) beside[beside.back()[side]][side ^ 1] = *here;
    return *here;
}

// Opens tiles taken to be full beside tiles taken to be empty, where a bound is wrong; the same in all layers of a group.
void Slab::mend() {
    if (!torn_) torn_ = torn();
    for (const Place& p : *torn_) add(p.y, p.x);
}

std::vector<Place> Slab::torn() const {
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
struct Slab::Differing {
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
void Slab::close() {
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

bool Slab::is_closed() const {
    for (int32_t t = kTiles; t < int32_t(count()); ++t) {
        const Differing d(beside[t], inside.data(), inside[t]);
        if ((d.words[0] | d.words[1] | d.words[2] | d.words[3]) & ~known[t]) return false;
    }
    return true;
}

// One wave of the closure: the implied samples that differ from a neighbour. Tiles made on the way become active; tiles at
// the rim that reach it are to be looked at again.
void Slab::ask(std::vector<int32_t>& active, std::vector<int32_t>& again) {
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
void Slab::enlarge(int32_t t, std::vector<int32_t>& active, std::vector<int32_t>& again) {
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
void Slab::corners() {
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
std::vector<Slab::Edge> Slab::edges() const {
    std::vector<Edge> result;
    for (int32_t t = kTiles; t < int32_t(count()); ++t)
        crossed(t, kAll, [&](int number, float first, float second) { result.push_back({t, number, first, second}); });
    return result;
}

// Those of one tile in `step`.
Slab::Middles Slab::middles(int32_t step) const {
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
float Slab::inside_scale() {
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
