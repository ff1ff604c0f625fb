#include "deflate.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

namespace fracslice::slices {
namespace {

constexpr int kEnd = 256, kCodes = 286, kMostBits = 15;
constexpr ptrdiff_t kMany = 1 << 14;  // symbols: where there are more, `kSampled` of each `kOf` are counted
constexpr ptrdiff_t kSampled = 64, kOf = 8 * kSampled;

// The code of a length: a symbol, and bits after it.
struct Length {
    uint16_t symbol;
    uint8_t extra, bits;
};
const std::array<Length, kLongest + 1> kLengths = [] {
    std::array<Length, kLongest + 1> lengths{};
    uint16_t symbol = kEnd + 1;
    for (int length = kShortest, wide = 0; length < kLongest; ++symbol) {
        // Four symbols for each number of extra bits, eight for none.
        wide = std::max(0, (symbol - kEnd - 1) / 4 - 1);
        for (int i = 0; i < 1 << wide && length < kLongest; ++i, ++length) lengths[length] = {symbol, uint8_t(wide), uint8_t(i)};
    }
    lengths[kLongest] = {kCodes - 1, 0, 0};
    return lengths;
}();

using Counts = std::array<uint32_t, kCodes>;
using Sizes = std::array<uint8_t, kCodes>;

// How many bits each symbol takes (Huffman 1952), at most 15: rare ones are made less rare until they do.
Sizes sizes_of(Counts counts) {
    std::array<uint64_t, kCodes> used;  // the count, then the symbol
    std::array<uint64_t, 2 * kCodes> weight;
    std::array<int, 2 * kCodes> parent, depth;
    for (;;) {
        int n = 0;
        for (int s = 0; s < kCodes; ++s)
            if (counts[s]) used[n++] = uint64_t(counts[s]) << 16 | uint64_t(s);
        std::sort(used.begin(), used.begin() + n);
        for (int i = 0; i < n; ++i) weight[i] = used[i] >> 16;
        // Leaves and the nodes made of them both ascend: the least is the first of either.
        for (int leaf = 0, node = n, made = n; made < 2 * n - 1; ++made) {
            weight[made] = 0;
            for (int i = 0; i < 2; ++i) {
                int least = leaf < n && (node == made || weight[leaf] <= weight[node]) ? leaf++ : node++;
                weight[made] += weight[least], parent[least] = made;
            }
        }
        depth[2 * n - 2] = 0;
        for (int i = 2 * n - 3; i >= 0; --i) depth[i] = depth[parent[i]] + 1;
        if (depth[0] <= kMostBits) {
            Sizes sizes{};
            for (int i = 0; i < n; ++i) sizes[used[i] & 0xFFFF] = uint8_t(std::max(depth[i], 1));  // one symbol takes a bit, too
            return sizes;
        }
        for (uint32_t& count : counts) count = count ? count / 2 + 1 : 0;
    }
}

// Bits, the first lowest: at most 56 of them.
struct Code {
    uint64_t bits;
    int size;

    Code then(const Code& next) const { return {bits | next.bits << size, size + next.size}; }
};

constexpr uint32_t reversed(uint32_t bits, int size) {
    uint32_t turned = 0;
    for (int b = 0; b < size; ++b) turned |= (bits >> b & 1) << (size - 1 - b);
    return turned;
}

// The canonical codes of those sizes.
std::array<Code, kCodes> codes_of(const Sizes& sizes) {
    std::array<uint32_t, kMostBits + 2> next{};
    for (uint8_t size : sizes) next[size + 1] += size > 0;
    for (int size = 1; size <= kMostBits; ++size) next[size] = (next[size - 1] + next[size]) * 2;
    assert(next[kMostBits] + next[kMostBits + 1] <= 1u << kMostBits);  // Kraft's inequality
    std::array<Code, kCodes> codes{};
    for (int s = 0; s < kCodes; ++s)
        if (const int size = sizes[s]) codes[s] = {reversed(next[size]++, size), size};
    return codes;
}

// Bits after bits.
class Bits {
 public:
    explicit Bits(uint8_t* out) : out_(out) {}
    void put(const Code& code) {
        assert(code.size <= 56);
        word_ |= code.bits << size_;
        size_ += unsigned(code.size);
        std::memcpy(out_, &word_, 8);
        out_ += size_ / 8;
        word_ >>= size_ / 8 * 8;
        size_ %= 8;
    }
    uint8_t* end() {
        if (size_) put({0, 8 - int(size_)});
        return out_;
    }

 private:
    uint8_t* out_;
    uint64_t word_ = 0;
    unsigned size_ = 0;
};

// Dynamic codes: those of literals and lengths, and one of one bit for the only distance. The sizes of codes are written in
// four bits each.
void put_head(Bits& out, const Sizes& sizes) {
    out.put({0x0178, 16});           // deflate, a window of 32 kB; fastest
    out.put({1 | 2 << 1, 3});        // the last block, dynamic
    out.put({kCodes - 257, 5});
    out.put({0, 5});
    out.put({19 - 4, 4});
    constexpr int order[] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    for (int s : order) out.put({s < 16 ? 4u : 0u, 3});
    for (uint8_t size : sizes) out.put({reversed(size, 4), 4});
    out.put({reversed(1, 4), 4});
}

const std::array<Meaning, Runs::kSymbols> kMeanings = [] {
    std::array<Meaning, Runs::kSymbols> meanings{};
    for (int value = 0; value < 256; ++value) meanings[value] = {uint8_t(value), 1, 0, 0};
    for (int rest = 0; rest < kLongest; ++rest) {
        const bool match = rest >= kShortest;
        const uint8_t bytes = match ? 1 : uint8_t(1 + rest);
        meanings[Runs::kPlain + rest] = {0, bytes, match, uint16_t(rest)};
        meanings[Runs::kPlain + kLongest + rest] = {255, bytes, match, uint16_t(rest)};
        meanings[Runs::kMatch + rest] = {0, 0, match, uint16_t(rest)};
    }
    for (uint8_t n = 0; n < 4; ++n) meanings[Runs::kMore + n] = {0, 0, n, kLongest};
    return meanings;
}();

// How often codes come in symbols, an even number.
Counts counts_of(const uint16_t* symbols, const uint16_t* end) {
    // Two counts, for the same symbol may come twice in a row.
    uint32_t uses[2][Runs::kSymbols] = {};
    const ptrdiff_t step = end - symbols > kMany ? kOf : kSampled;
    for (; symbols < end; symbols += std::min(step, end - symbols))
        for (const uint16_t *s = symbols, *to = s + std::min(kSampled, end - s); s != to; s += 2) ++uses[0][s[0]], ++uses[1][s[1]];

    Counts counts;
    counts.fill(step > kSampled);
    counts[kEnd] = 1;
    for (int s = 0; s < Runs::kSymbols; ++s) {
        const Meaning& meaning = kMeanings[s];
        const uint32_t n = uses[0][s] + uses[1][s];
        counts[meaning.byte] += meaning.bytes * n;
        counts[kLengths[meaning.length].symbol] += meaning.matches * n;
    }
    return counts;
}

// The code of each symbol.
using Emissions = std::array<Code, Runs::kSymbols>;
Emissions emissions_of(const std::array<Code, kCodes>& codes) {
    Emissions emissions{};
    for (int s = 0; s < Runs::kSymbols; ++s) {
        const Meaning& meaning = kMeanings[s];
        const Length& length = kLengths[meaning.length];
        for (int i = 0; i < meaning.bytes; ++i) emissions[s] = emissions[s].then(codes[meaning.byte]);
        for (int i = 0; i < meaning.matches; ++i)
            emissions[s] = emissions[s].then(codes[length.symbol]).then({length.bits, length.extra}).then({0, 1});
    }
    return emissions;
}

}  // namespace

Runs::End Runs::End::other(End end) {
    const uint64_t rest = (end.length - 1) % kLongest;
    *end.symbol++ = end.value;
    if (rest >= kShortest)
        *end.symbol++ = uint16_t(kMatch + rest);
    else
        end.symbol = std::fill_n(end.symbol, rest, end.value);
    end.more((end.length - 1) / kLongest);
    end.length = 0;
    return end;
}

Runs::End Runs::End::mixed(End end, const uint8_t* from, int n) {
    for (int i = 0; i < n; ++i) end.add(from[i], 1);
    end.close();
    return end;
}

void Runs::add(uint8_t value, uint64_t n) {
    End end = reserve(kAtOnce, 0);
    end.add(value, n);
    set(end);
}

Runs::End Runs::reserve(size_t symbols, uint64_t n) {
    const size_t count = size_t(end_.symbol - symbols_.data());
    symbols += count + size_t((n + end_.length) / kLongest) + kAtOnce;
    if (symbols > symbols_.size()) {
        symbols_.resize(2 * symbols);
        end_.symbol = symbols_.data() + count;
    }
    return end_;
}

const Meaning* Runs::meanings() { return kMeanings.data(); }

const uint16_t* Runs::finish() {
    End last = reserve(kAtOnce, 0);
    last.close();
    while ((last.symbol - symbols_.data()) % 4) *last.symbol++ = kNothing;
    return last.symbol;
}

const Rows<uint8_t>& Runs::zlib(uint32_t checksum) {
    const uint16_t *end = finish(), *symbols = symbols_.data();
    const Sizes sizes = sizes_of(counts_of(symbols, end));
    const std::array<Code, kCodes> codes = codes_of(sizes);
    const Emissions emissions = emissions_of(codes);

    data_.resize(1024 + 8 * size_t(end - symbols));
    Bits out(data_.data());
    put_head(out, sizes);
    for (const uint16_t* s = symbols; s != end; s += 4) {
        const Code first = emissions[s[0]].then(emissions[s[1]]), second = emissions[s[2]].then(emissions[s[3]]);
        if (first.size + second.size <= 56) {
            out.put(first.then(second));
        } else {
            for (int i = 0; i < 4; ++i) out.put(emissions[s[i]]);
        }
    }
    out.put(codes[kEnd]);
    uint8_t* to = out.end();
    assert(to + 4 <= data_.data() + data_.size());
    for (int shift = 24; shift >= 0; shift -= 8) *to++ = uint8_t(checksum >> shift);
    data_.resize(size_t(to - data_.data()));
    return data_;
}

namespace {

uint8_t paeth(int left, int above, int corner) {
    const int a = std::abs(above - corner), b = std::abs(left - corner), c = std::abs(left + above - 2 * corner);
    return uint8_t(a <= b && a <= c ? left : b <= c ? above : corner);
}

template <class Predict>
uint32_t filtered(const uint8_t* row, const uint8_t* above, size_t width, size_t pixel, uint8_t* out, Predict predict) {
    uint32_t sum = 0;
    for (size_t k = 0; k < width; ++k) {
        const int left = k < pixel ? 0 : row[k - pixel], corner = k < pixel ? 0 : above[k - pixel];
        out[k] = uint8_t(row[k] - predict(left, above[k], corner));
        sum += uint32_t(std::abs(int8_t(out[k])));
    }
    return sum;
}

}  // namespace

void filter_rows(const uint8_t* rows, size_t count, size_t width, size_t pixel, uint8_t* out) {
    std::array<std::vector<uint8_t>, 5> tried;
    for (auto& bytes : tried) bytes.resize(width);
    for (size_t y = 0; y < count; ++y, out += width + 1) {
        const uint8_t *above = rows + y * width, *row = above + width;
        const auto sum = [&](size_t kind, auto predict) {
            return filtered(row, above, width, pixel, tried[kind].data(), predict);
        };
        const std::array<uint32_t, 5> sums{sum(0, [](int, int, int) { return 0; }),
                                           sum(1, [](int left, int, int) { return left; }),
                                           sum(2, [](int, int up, int) { return up; }),
                                           sum(3, [](int left, int up, int) { return (left + up) / 2; }), sum(4, paeth)};
        const size_t best = size_t(std::min_element(sums.begin(), sums.end()) - sums.begin());
        out[0] = uint8_t(best);
        std::copy(tried[best].begin(), tried[best].end(), out + 1);
    }
}

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
