// Runs of equal bytes, deflated without ever being laid out.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace fracslice {

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
    struct Run {
        uint32_t value : 8, length : 24;
    };
    static constexpr uint64_t kLongest = (1 << 24) - 1;

    void close() {
        for (; length_ > kLongest; length_ -= kLongest) runs_.push_back({value_, kLongest});
        if (length_) runs_.push_back({value_, uint32_t(length_)});
        length_ = 0;
    }
    uint32_t adler() const;

    std::vector<Run> runs_;
    uint64_t length_ = 0;
    uint8_t value_ = 0;
};

}  // namespace fracslice
