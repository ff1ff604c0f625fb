// Outside in, and inside out: until every edge that the contour crosses has two evaluated ends.
#include <numeric>
#include <stdexcept>

#include "evaluate.h"

namespace fracslice {

int32_t Slab::add(int layer, int y, int x) {
    int32_t& here = where[(size_t(layer) * ty_ + y) * tx_ + x];
    push({layer, y, x}, inside[here]);
    return here = int32_t(count() - 1);
}

// Tiles said to be full beside ones said to be empty, where a bound is wrong; the same in all layers of a group.
void Slab::mend(int layer) {
    if (!torn_) torn_ = torn(layer);
    for (const Place& p : *torn_) add(layer, p.y, p.x);
}

std::vector<Place> Slab::torn(int layer) const {
    std::vector<Place> found;
    for (int y = 1; y < ty_ - 1; ++y) {
        const int32_t *row = spot(layer, y, 0), *below = row - tx_, *above = row + tx_;
        auto torn = [&](int x) {
            bool beside = (row[x - 1] == kEmpty) | (row[x + 1] == kEmpty) | (below[x] == kEmpty) | (above[x] == kEmpty);
            return (row[x] == kFull) & beside;
        };
        int32_t any = 0;
        for (int x = 1; x < tx_ - 1; ++x) any |= -int32_t(torn(x));
        for (int x = 1; any && x < tx_ - 1; ++x)
            if (torn(x)) found.push_back({layer, y, x});
    }
    return found;
}

void Slab::close(int layer) {
    std::vector<int32_t> active(count() - first_), again;
    std::iota(active.begin(), active.end(), first_);
    std::vector<uint8_t> marked;  // tiles that are in `again`, from the layer's first on
    while (!active.empty()) {
        asks_.clear(), again.clear();
        ask(active, again);
        marked.assign(count() - first_, 0);
        auto mark = [&](int32_t t) {
            if (t < kTiles || marked[t - first_]) return;
            marked[t - first_] = 1;
            again.push_back(t);
        };
        for (int32_t t : again) marked[t - first_] = 1;
        const Rim none{0, reach.data(), INFINITY};
        evaluate(layer, asks_, none, [&](const Ask& ask, const Found& found) {
            const int32_t t = ask.tile;
            const uint64_t turned = (inside[t] ^ found.negative) & ask.samples;
            known[t] |= ask.samples;
            if (!turned) return;
            inside[t] ^= turned;
            const int32_t* here = spot(layer, place[t].y, place[t].x);
            mark(t);
            if (turned & kLastColumn) mark(here[1]);
            if (turned & kFirstColumn) mark(here[-1]);
            if (turned & kLastRow) mark(here[tx_]);
            if (turned & kFirstRow) mark(here[-tx_]);
        });
        std::swap(active, again);
    }
}

// One wave of the closure: the implied samples that differ from a neighbour. Tiles made on the way become active; tiles at
// the rim that reach it are to be looked at again.
void Slab::ask(std::vector<int32_t>& active, std::vector<int32_t>& again) {
    constexpr uint64_t faces[] = {kLastColumn, kFirstColumn, kLastRow, kFirstRow};
    constexpr int dy[] = {0, 0, 1, -1}, dx[] = {1, -1, 0, 0};
    size_t asked = 0;
    for (size_t a = 0; a < active.size(); ++a) {
        const int32_t t = active[a];
        const Place p = place[t];
        const int32_t* here = spot(p.layer, p.y, p.x);
        const int32_t beside[] = {here[1], here[-1], here[tx_], here[-tx_]};
        const uint64_t s = inside[t], kept = known[t];
        const uint64_t differing[] = {s ^ rights(s, inside[beside[0]]), s ^ lefts(s, inside[beside[1]]),
                                      s ^ uppers(s, inside[beside[2]]), s ^ lowers(s, inside[beside[3]])};
        // Whether a tile has any is hard to foretell: all are written, and those without written over.
        if (asked == asks_.size()) asks_.resize(asked + active.size());
        asks_[asked] = {t, (differing[0] | differing[1] | differing[2] | differing[3]) & ~kept};
        asked += asks_[asked].samples != 0;
        uint64_t open = 0;
        for (int side = 0; side < 4; ++side) open |= beside[side] < kTiles ? differing[side] & faces[side] : 0;
        for (int side = 0; open && side < 4; ++side) {
            uint64_t face = differing[side] & faces[side];
            if (!face || beside[side] >= kTiles) continue;
            int y = p.y + dy[side], x = p.x + dx[side];
            if (y > 0 && x > 0 && y < ty_ - 1 && x < tx_ - 1)
                active.push_back(add(p.layer, y, x));
            else if (face & kept)
                throw std::domain_error("the solid reaches the border of the layers");
            else
                again.push_back(t);
        }
    }
    asks_.resize(asked);
}

// Tiles of which the contour cuts nothing but the last cell, at the corner.
void Slab::corners() {
    for (int32_t t = first_, n = int32_t(count()); t < n; ++t) {
        Place p = place[t];
        int32_t there = at(p.layer, p.y - 1, p.x - 1);
        if (there < kTiles && (there == kFull) != bool(inside[t] & 1)) add(p.layer, p.y - 1, p.x - 1);
    }
}

}  // namespace fracslice
