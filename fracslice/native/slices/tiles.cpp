#include "tiles.h"

#include <algorithm>
#include <cmath>

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

}  // namespace fracslice::slices
