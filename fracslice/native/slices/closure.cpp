// Outside in, and inside out: until every edge that the contour crosses has two evaluated ends.
#include <cassert>
#include <numeric>
#include <stdexcept>

#include "evaluate.h"

namespace fracslice::slices {

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

}  // namespace fracslice::slices
