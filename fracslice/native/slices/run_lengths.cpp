#include "run_lengths.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace fracslice::slices {
namespace {

// Writes runs; each encoding has a static `level` of a coverage, and `run` of n equal levels.
class Bytes {
 public:
    Rows<uint8_t> data;

 protected:
    void put(uint64_t byte) { data.push_back(uint8_t(byte)); }
};

// .goo V3.0, after the crate goo (0.1.1). Big-endian; a chunk has its kind in two bits, then the size of its length in two more, or, if
// it holds a difference, the sign and whether a length follows.
class Goo : public Bytes {
 public:
    static constexpr uint8_t kMark = 0x55;

    Goo() { data.assign(1, kMark); }
    static uint8_t level(uint8_t value) { return value; }
    void run(uint8_t value, uint64_t n) {
        constexpr uint64_t most = 0xFFFFFFF;
        const int difference = value - before_;
        before_ = value;
        if (value != 0 && value != 255 && std::abs(difference) <= 15 && n <= 255) {
            put(0x80 | (difference < 0) << 5 | (n > 1) << 4 | std::abs(difference));
            if (n > 1) put(n);
            return;
        }
        for (; n > most; n -= most) chunk(value, most);
        chunk(value, n);
    }
    void end() { put(~std::accumulate(data.begin() + 1, data.end(), 0u)); }

 private:
    void chunk(uint8_t value, uint64_t n) {
        const int size = n <= 0xF ? 0 : n <= 0xFFF ? 1 : n <= 0xFFFFF ? 2 : 3;
        put((value == 0 ? 0 : value == 255 ? 3 : 1) << 6 | size << 4 | (n & 0xF));
        if (value != 0 && value != 255) put(value);
        for (int shift = 8 * size - 4; shift > 0; shift -= 8) put(n >> shift);
    }
    int before_ = 0;
};

// Biffle, "CTB/CBDDLP file formats" (catibo): the highest bit says that a length follows; its own highest bits, of how many bytes.
class Rle7 : public Bytes {
 public:
    static uint8_t level(uint8_t value) { return value >> 1; }
    void run(uint8_t value, uint64_t n) {
        constexpr uint64_t most = (1 << 28) - 1;
        for (; n > most; n -= most) chunk(value, most);
        chunk(value, n);
    }
    void end() {}

 private:
    void chunk(uint8_t value, uint64_t n) {
        if (n == 1) return put(value);
        const int size = n < 1 << 7 ? 0 : n < 1 << 14 ? 1 : n < 1 << 21 ? 2 : 3;
        put(0x80 | value);
        put((0xF00 >> size & 0xFF) | n >> 8 * size);
        for (int shift = 8 * size - 8; shift >= 0; shift -= 8) put(n >> shift);
    }
};

// Anycubic: the level in four bits, the length in four more; of the lowest and highest level in twelve.
class Rle4 : public Bytes {
 public:
    static uint8_t level(uint8_t value) { return uint8_t((value + 8) / 17); }
    void run(uint8_t value, uint64_t n) {
        const bool wide = value == 0 || value == 15;
        for (const uint64_t most = wide ? 0xFFF : 0xF; n; n -= std::min(n, most)) {
            const uint64_t length = std::min(n, most);
            put(uint64_t(value) << 4 | (wide ? length >> 8 : length));
            if (wide) put(length);
        }
    }
    void end() {}
};

// Biffle, as above: one bit, then the length.
class Rle1 : public Bytes {
 public:
    static uint8_t level(uint8_t value) { return value >> 7; }
    void run(uint8_t value, uint64_t n) {
        constexpr uint64_t most = 125;  // as the makers' programs do
        for (; n; n -= std::min(n, most)) put(uint64_t(value) << 7 | std::min(n, most));
    }
    void end() {}
};

template <class Encoder>
const Rows<uint8_t>& encoded(Runs& runs) {
    thread_local Rows<uint8_t> kept;
    Encoder encoder;
    uint8_t value = 0;
    uint64_t length = 0;
    runs.each([&](uint8_t byte, uint64_t n) {
        const uint8_t level = Encoder::level(byte);
        if (level != value && length) encoder.run(value, std::exchange(length, 0));
        value = level, length += n;
    });
    if (length) encoder.run(value, length);
    encoder.end();
    return kept = std::move(encoder.data);
}

}  // namespace

const Rows<uint8_t>& run_lengths(Runs& runs, Encoding encoding) {
    switch (encoding) {
        case Encoding::goo: return encoded<Goo>(runs);
        case Encoding::rle7: return encoded<Rle7>(runs);
        case Encoding::rle4: return encoded<Rle4>(runs);
        case Encoding::rle1: return encoded<Rle1>(runs);
        case Encoding::png: break;
    }
    throw std::invalid_argument("no run lengths");
}

}  // namespace fracslice::slices
