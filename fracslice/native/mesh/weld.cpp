#include "weld.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "../compiler.h"

namespace fracslice::mesh {
namespace {

// How many points ahead their slots are asked for: without, most of the time goes into waiting for memory.
constexpr size_t kAhead = 16;

size_t mixed(const uint32_t* point) {
    uint64_t mixed = (point[0] * 0x9E3779B97F4A7C15u) ^ (point[1] * 0xC2B2AE3D27D4EB4Fu) ^ (point[2] * 0x165667B19E3779F9u);
    mixed = (mixed ^ (mixed >> 29)) * 0xBF58476D1CE4E5B9u;
    return mixed ^ (mixed >> 32);
}

}  // namespace

Welded weld(std::span<const uint32_t> bits) {
    const size_t count = bits.size() / 3;
    if (count > INT32_MAX) throw std::invalid_argument("more than 2^31 points");
    size_t slots = 16;
    while (slots <= 2 * count) slots *= 2;
    std::vector<int32_t> table(slots, -1);  // of sets, with open addressing
    Welded result{{count, 1}, {count, 1}};
    int32_t sets = 0;
    for (size_t i = 0; i < count; ++i) {
        const uint32_t* point = &bits[3 * i];
        if (i + kAhead < count) prefetch(&table[mixed(point + 3 * kAhead) & (slots - 1)]);
        size_t slot = mixed(point) & (slots - 1);
        while (table[slot] >= 0 && !std::equal(point, point + 3, &bits[3 * size_t(result.first.data[table[slot]])])) {
            slot = (slot + 1) & (slots - 1);
        }
        if (table[slot] < 0) {
            table[slot] = sets;
            result.first.data[sets++] = int64_t(i);
        }
        result.labels.data[i] = table[slot];
    }
    result.first.rows = size_t(sets);
    return result;
}

}  // namespace fracslice::mesh
