// Runs of equal bytes, deflated without ever being laid out.
#pragma once
#include <cassert>
#include <cstdint>
#include <cstring>

#include "tiles.h"

namespace fracslice::slices {

constexpr int kShortest = 3, kLongest = 258;  // bytes that a match repeats

// A symbol of `Runs`: a byte, repeated; then matches of one length.
struct Meaning {
    uint8_t byte, bytes, matches;
    uint16_t length;
};

// A string of bytes, given run by run; `zlib` writes it as RFC 1950 and 1951 have it, in one block with codes of its own.
// Matches repeat the byte before them, no other is looked for. Its memory can be used again.
class Runs {
 public:
    static constexpr int kAtOnce = 8;  // bytes

    // Symbols: bytes; a zero or a 255 and how many times it comes again, less than a longest match; a match of any byte; and so
    // many longest ones, at most three.
    static constexpr int kPlain = 256, kMatch = kPlain + 2 * kLongest, kMore = kMatch + kLongest, kNothing = kMore + 4,
                         kSymbols = kNothing + 1;

    // Where the next symbol goes, and the run so far.
    struct End {
        uint16_t* symbol;
        uint64_t length;
        uint8_t value;

        // A run, or more of the last one.
        void add(uint8_t next, uint64_t n) {
            if (next != value) {
                close();
                value = next;
            }
            length += n;
        }
        // Ends the run of zeros or 255s so far, which is not empty, with n bytes, at most `kAtOnce`; twice as many may be read.
        void cut(const uint8_t* from, int n) {
            using Bytes = uint8_t __attribute__((vector_size(2 * kAtOnce)));
            plain();
            Bytes bytes;
            std::memcpy(&bytes, from, sizeof bytes);
            bytes = __builtin_shufflevector(bytes, Bytes{}, 0, 16, 1, 16, 2, 16, 3, 16, 4, 16, 5, 16, 6, 16, 7, 16);
            std::memcpy(symbol, &bytes, sizeof bytes);
            symbol += n;
        }
        // Ends any run.
        void close() {
            if (length == 0) return;
            if (value == 0 || value == 255)
                plain();
            else
                *this = other(*this);
        }
        // Bytes among which there may be runs.
        void mixed(const uint8_t* from, int n) { *this = mixed(*this, from, n); }

     private:
        // By value, for what has an address is in no register.
        static End other(End end);
        static End mixed(End end, const uint8_t* from, int n);

        void plain() {
            uint64_t rest = length - 1, longest = 0;
            if (rest >= kLongest) longest = rest / kLongest, rest %= kLongest;
            *symbol++ = uint16_t(kPlain + (kLongest & int8_t(value)) + int(rest));
            more(longest);
            length = 0;
        }
        void more(uint64_t longest) {
            for (; longest > 3; longest -= 3) *symbol++ = kMore + 3;
            if (longest) *symbol++ = uint16_t(kMore + longest);
        }
    };

    // Begins.
    void clear() { end_ = {symbols_.data(), 0, 0}; }
    void add(uint8_t value, uint64_t n);
    // The end, with memory for more symbols and for longest matches of n bytes; `set` takes it back, advanced.
    End reserve(size_t symbols, uint64_t n);
    void set(const End& end) {
        assert(end.symbol <= symbols_.data() + symbols_.size());
        end_ = end;
    }
    // Ends; checksum: of all bytes. The result stays until another is asked for.
    const Rows<uint8_t>& zlib(uint32_t checksum);
    // Ends; visit(value, n): each run, which may go on in the next one.
    template <class Visit>
    void each(const Visit& visit) {
        const uint16_t* end = finish();
        uint8_t value = 0;
        for (const uint16_t* s = symbols_.data(); s != end; ++s) {
            const Meaning& meaning = meanings()[*s];
            if (meaning.bytes) value = meaning.byte;
            if (const uint64_t n = meaning.bytes + uint64_t(meaning.matches) * meaning.length) visit(value, n);
        }
    }

 private:
    // Ends the last run; the end of the symbols, whose number is a multiple of 4.
    const uint16_t* finish();
    static const Meaning* meanings();

    Rows<uint16_t> symbols_;
    Rows<uint8_t> data_;
    End end_;
};

}  // namespace fracslice::slices
