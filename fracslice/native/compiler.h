// Hints that only some compilers take.
#pragma once
#include <cstdint>

namespace fracslice {

// Fetches the cache line of an address that is read soon.
inline void prefetch([[maybe_unused]] const void* address) {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#endif
}

// The bytes in reverse order.
inline uint64_t byteswapped(uint64_t word) {
#if defined(__GNUC__)
    return __builtin_bswap64(word);
#else
    word = (word & 0x00FF00FF00FF00FF) << 8 | (word >> 8 & 0x00FF00FF00FF00FF);
    word = (word & 0x0000FFFF0000FFFF) << 16 | (word >> 16 & 0x0000FFFF0000FFFF);
    return word << 32 | word >> 32;
#endif
}

}  // namespace fracslice
