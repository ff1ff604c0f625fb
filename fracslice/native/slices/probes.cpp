// One sample of each block of 2 of undecided tiles, and the others, as long as no value reaches them.
#include "evaluate.h"

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

}  // namespace fracslice::slices
