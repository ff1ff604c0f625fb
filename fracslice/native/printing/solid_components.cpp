#include "sampled_field.h"

#include <array>
#include <numeric>

#include "../disjoint_sets.h"

namespace fracslice::printing {
namespace {

using volume::kInside;
using volume::kSamples;
using volume::kSide;

// Brick coordinates of a row.
std::array<int, 3> brick_of(const volume::Layout& layout, size_t row) {
    const int32_t* ijk = layout.ijk + 3 * row;
    return {ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3};
}

// Elements of a forest: 0 is the space beyond the samples, then come the samples, then the unsampled bricks.
template <class Index, class Value>
class Elements {
  public:
    Elements(const volume::Layout& layout, const Value* values, std::span<Index> parent)
        : layout_(layout), values_(values), parent_(parent), sets_(parent), tile_(size_t(layout.size[0]) * size_t(layout.size[1]) * size_t(layout.size[2])) {
        Index next = Index(1 + layout.count * kSamples);
        for (size_t b = 0; b < tile_.size(); ++b) tile_[b] = layout.index[b] < 0 ? next++ : 0;
    }

    // Unites unsampled bricks of the same side that have a face in common.
    void unite_tiles() {
        const auto [nx, ny, nz] = layout_.size;
        for (int x = 0; x <= nx; ++x)
            for (int y = 0; y <= ny; ++y)
                for (int z = 0; z <= nz; ++z) {
                    const int32_t here = layout_.at(x, y, z);
                    if (here >= 0) continue;
                    for (const auto& [u, v, w] : {std::array{x - 1, y, z}, std::array{x, y - 1, z}, std::array{x, y, z - 1}}) {
                        if (layout_.at(u, v, w) == here) sets_.unite(tile(x, y, z), tile(u, v, w));
                    }
                }
    }

    // Unites the samples of a brick with those beside them, and with unsampled bricks.
    void unite_samples(size_t row) {
        const auto brick = brick_of(layout_, row);
        const Value* f = values_ + row * kSamples;
        for (int axis = 2; axis >= 0; --axis) {
            const int shift = 6 - 3 * axis;
            auto before = brick, behind = brick;
            --before[size_t(axis)], ++behind[size_t(axis)];
            const int32_t previous = layout_.at(before[0], before[1], before[2]), next = layout_.at(behind[0], behind[1], behind[2]);
            const Index first = tile(before[0], before[1], before[2]), last = tile(behind[0], behind[1], behind[2]);
            for (int s = 0; s < kSamples; ++s) {
                const bool here = f[s] < 0;
                const Index element = sample(row, s);
                const int at = s >> shift & 7;
                if (at < kSide - 1) {
                    unite_like(here, element, f[s + (1 << shift)] < 0, element + (1 << shift));
                } else if (next >= 0) {
                    const int t = s - (7 << shift);
                    unite_like(here, element, values_[size_t(next) * kSamples + size_t(t)] < 0, sample(size_t(next), t));
                } else {
                    unite_like(here, element, next == kInside, last);
                }
                if (at == 0 && previous < 0) unite_like(here, element, previous == kInside, first);
            }
        }
    }

    Index number() { return sets_.number(); }

  private:
    static Index sample(size_t row, int s) { return Index(1 + row * kSamples + size_t(s)); }
    Index tile(int x, int y, int z) const {
        const auto [nx, ny, nz] = layout_.size;
        const bool within = x >= 0 && y >= 0 && z >= 0 && x < nx && y < ny && z < nz;
        return within ? tile_[(size_t(x) * size_t(ny) + size_t(y)) * size_t(nz) + size_t(z)] : 0;
    }
    void unite_like(bool side, Index element, bool other_side, Index other) {
        if (side == other_side && parent_[size_t(element)] != parent_[size_t(other)]) sets_.unite(element, other);
    }

    const volume::Layout& layout_;
    const Value* values_;
    std::span<const Index> parent_;
    DisjointSets<Index> sets_;
    std::vector<Index> tile_;  // element of each unsampled brick
};

}  // namespace

template <class Index, class Value>
SolidComponents<Index> solid_components(const volume::Layout& layout, const Value* values) {
    const size_t bricks = size_t(layout.size[0]) * size_t(layout.size[1]) * size_t(layout.size[2]);
    const size_t samples = layout.count * kSamples;
    SolidComponents<Index> result{{1 + samples + bricks - layout.count, 1}, {}, {}};
    std::span<Index> of(result.of.data.get(), result.of.rows);
    std::iota(of.begin(), of.end(), Index(0));
    Elements<Index, Value> elements(layout, values, of);
    elements.unite_tiles();
    for (size_t row = 0; row < layout.count; ++row) elements.unite_samples(row);
    const size_t count = size_t(elements.number());
    result.sizes.resize(count);
    result.inside.resize(count);
    auto add = [&](size_t element, int64_t size, bool inside) {
        const size_t component = size_t(of[element]);
        result.sizes[component] += size;
        result.inside[component] = inside;
    };
    for (size_t s = 0; s < samples; ++s) add(1 + s, 1, values[s] < 0);
    for (size_t b = 0, element = 1 + samples; b < bricks; ++b) {
        if (layout.index[b] < 0) add(element++, kSamples, layout.index[b] == kInside);
    }
    return result;
}

template <class Index, class Value>
std::vector<int64_t> crossings_by_component(const volume::Layout& layout, const Value* values, const Index* labels, size_t count) {
    std::vector<int64_t> crossings(count);
    for (size_t row = 0; row < layout.count; ++row) {
        for (int axis = 0; axis < 3; ++axis) {
            auto behind = brick_of(layout, row);
            ++behind[size_t(axis)];
            const int32_t next = layout.at(behind[0], behind[1], behind[2]);
            const int shift = 6 - 3 * axis;
            for (int s = 0; s < kSamples; ++s) {
                const bool is_last = (s >> shift & 7) == kSide - 1;
                if (is_last && next < 0) continue;
                const size_t here = row * kSamples + size_t(s);
                const size_t there = is_last ? size_t(next) * kSamples + size_t(s - (7 << shift)) : here + (size_t(1) << shift);
                if ((values[here] < 0) != (values[there] < 0)) ++crossings[size_t(labels[values[here] < 0 ? here : there])];
            }
        }
    }
    return crossings;
}

#define FRACSLICE_COMPONENTS(Index, Value)                                                                  \
    template SolidComponents<Index> solid_components<Index, Value>(const volume::Layout&, const Value*);    \
    template std::vector<int64_t> crossings_by_component<Index, Value>(const volume::Layout&, const Value*, \
                                                                       const Index*, size_t);
FRACSLICE_COMPONENTS(int32_t, float)
FRACSLICE_COMPONENTS(int32_t, int8_t)
FRACSLICE_COMPONENTS(int64_t, float)
FRACSLICE_COMPONENTS(int64_t, int8_t)

}  // namespace fracslice::printing
