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
    std::vector<uint8_t> zlib();

 private:
    // With d_i the n bytes: 1 + sum d_i, and n + sum (n - i) d_i, modulo 65521 (RFC 1950).
    struct Adler {
        uint64_t at = 0, sum = 0, weighted = 0;  // modulo 65521, now and then

        void run(uint64_t value, uint64_t length);
        void word(uint64_t bytes, uint64_t n);
        void reduce();
        uint32_t value();
    };

    void reserve(size_t symbols);
    void close();
    void compare(const uint8_t* bytes, uint32_t n);

    // Symbols: bytes; and how many times the byte before them comes again, two or three times the most among them.
    Rows<uint16_t> symbols_;
    size_t count_ = 0;
    Adler sum_;
    uint64_t length_ = 0;
    uint8_t value_ = 0;
};

}  // namespace fracslice
