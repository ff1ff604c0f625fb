// Runs of equal bytes, deflated without ever being laid out.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace fracslice {

constexpr int kShortest = 3, kLongest = 258;  // bytes that a match repeats

// A string of bytes, said run by run; `zlib` writes it as RFC 1950 and 1951 have it, in one block with codes of its own.
// Matches repeat the byte before them, no other is looked for.
class Runs {
 public:
    void add(uint8_t value, uint64_t n) {
        if (value != value_) {
            close();
            value_ = value;
        }
        length_ += n;
    }
    std::vector<uint8_t> zlib();

 private:
    // A byte and how many times more it comes, which is what one match says or none; or so many longest matches of it.
    struct Part {
        uint32_t value : 8, more : 23, longest : 1;

        uint64_t length() const { return longest ? uint64_t(more) * kLongest : more + uint64_t(1); }
    };

    void close() {
        const uint64_t more = length_ - 1;
        if (more == 0 || (more >= kShortest && more <= kLongest))
            parts_.push_back({value_, uint32_t(more), 0});
        else
            split();
        length_ = 0;
    }
    void split();

    std::vector<Part> parts_;
    uint64_t length_ = 0;
    uint8_t value_ = 0;
};

}  // namespace fracslice
