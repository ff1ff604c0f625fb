// Work in blocks of equal size: the results of the blocks are joined in order, so that they are the same for any number of
// threads.
#pragma once
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace fracslice::mesh {

constexpr size_t kBlock = size_t(1) << 14;

constexpr size_t blocks_of(size_t count) { return (count + kBlock - 1) / kBlock; }

// Calls act(block, first, last) for each block of `count` things.
template <class Do>
void for_each_block(size_t count, const Do& act) {
    tbb::parallel_for(size_t(0), blocks_of(count), [&](size_t k) { act(k, k * kBlock, std::min(count, (k + 1) * kBlock)); });
}

// Calls act(number) for each number below `count`.
template <class Do>
void for_each_number(size_t count, const Do& act) {
    for_each_block(count, [&](size_t, size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) act(i);
    });
}

// What act(first, last) returns for each block of `count` things.
template <class Part, class Do>
std::vector<Part> in_blocks(size_t count, const Do& act) {
    std::vector<Part> parts(blocks_of(count));
    for_each_block(count, [&](size_t k, size_t first, size_t last) { parts[k] = act(first, last); });
    return parts;
}

template <class T>
std::vector<T> joined(const std::vector<std::vector<T>>& parts) {
    std::vector<T> all;
    for (const std::vector<T>& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

// The numbers below `count` for which choose(number) holds, ascending.
template <class Do>
std::vector<int64_t> chosen(size_t count, const Do& choose) {
    return joined(in_blocks<std::vector<int64_t>>(count, [&](size_t first, size_t last) {
        std::vector<int64_t> result;
        for (size_t i = first; i < last; ++i) {
            if (choose(i)) result.push_back(int64_t(i));
        }
        return result;
    }));
}

// Of each block of `count` things how many before it hold, and behind the last how many in all.
template <class Do>
std::vector<size_t> counted(size_t count, const Do& holds) {
    std::vector<size_t> before = in_blocks<size_t>(count, [&](size_t first, size_t last) {
        size_t result = 0;
        for (size_t i = first; i < last; ++i) result += holds(i);
        return result;
    });
    size_t total = 0;
    for (size_t& number : before) total += std::exchange(number, total);
    before.push_back(total);
    return before;
}

}  // namespace fracslice::mesh
