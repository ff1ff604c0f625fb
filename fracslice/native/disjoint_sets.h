// Disjoint sets of numbers, as a forest.
#pragma once
#include <atomic>
#include <cassert>
#include <cstdint>
#include <span>

namespace fracslice {

// Sets over an array of parents, at first each its own, that one thread unites, or if they are shared any number. A root is the
// lowest of its set, and a parent is lower than its children: whoever loses a race looks again (Anderson and Woll, "Wait-free
// Parallel Algorithms for the Union-Find Problem", 1991).
template <class Index, bool kShared = false>
class DisjointSets {
  public:
    explicit DisjointSets(std::span<Index> parent) : parent_(parent) {}

    // Halves the path (Tarjan and van Leeuwen, 1984): what another thread has put there is an ancestor, too.
    Index root(Index v) const {
        for (Index up; (up = of(v).load(std::memory_order_relaxed)) != v; v = up) {
            const Index above = of(up).load(std::memory_order_relaxed);
            assert(up < v && above <= up);
            if (above != up) of(v).store(above, std::memory_order_relaxed);
        }
        return v;
    }

    // Whether they were disjoint.
    bool unite(Index a, Index b) const {
        while ((a = root(a)) != (b = root(b))) {
            const Index high = a > b ? a : b, low = a > b ? b : a;
            if constexpr (kShared) {
                Index expected = high;
                if (of(high).compare_exchange_strong(expected, low, std::memory_order_relaxed)) return true;
            } else {
                parent_[size_t(high)] = low;
                return true;
            }
        }
        return false;
    }

    // Replaces each parent by the number of its set, from 0 in the order of the lowest elements; returns how many there are.
    Index number() {
        Index count = 0;
        for (size_t i = 0; i < parent_.size(); ++i) {  // a parent is a lower element, which already has its number
            parent_[i] = parent_[i] == Index(i) ? count++ : parent_[size_t(parent_[i])];
        }
        return count;
    }

  private:
    std::atomic_ref<Index> of(Index v) const { return std::atomic_ref<Index>(parent_[size_t(v)]); }

    std::span<Index> parent_;
};

}  // namespace fracslice
