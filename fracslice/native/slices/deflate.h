// Runs of equal bytes, deflated without ever being laid out.
#pragma once
#include <cstdint>
#include <vector>

#include "tiles.h"

namespace fracslice {

constexpr int kShortest = 3, kLongest = 258;  // bytes that a match repeats

// A run of equal bytes, and n others after it, which are thought to differ: those from `at` on.
struct Span {
    uint8_t value;
    uint32_t length, at, n;
};

// A string of bytes, said run by run; `zlib` writes it as RFC 1950 and 1951 have it, in one block with codes of its own.
// Matches repeat the byte before them, no other is looked for.
class Runs {
 public:
    // Bytes that may be read after those of a span.
    static constexpr int kAtOnce = 8;

    // A run, or more of the last one.
    void add(uint8_t value, uint64_t n) {
        if (value != value_) {
            close();
            value_ = value;
        }
        length_ += n;
    }
    // The first run may be more of the last one, the others differ from what is before them.
    void add(const Span* spans, size_t n, const uint8_t* bytes);
    // checksum: of all bytes.
    Rows<uint8_t> zlib(uint32_t checksum);

 private:
    void reserve(size_t symbols);
    void close();
    void compare(const uint8_t* bytes, uint32_t n);

    // Symbols: bytes; and how many times the byte before them comes again, two or three times the most among them.
    Rows<uint16_t> symbols_;
    size_t count_ = 0;
    uint64_t length_ = 0;
    uint8_t value_ = 0;
};

}  // namespace fracslice
