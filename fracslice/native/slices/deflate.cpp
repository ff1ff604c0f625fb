#include "deflate.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace fracslice {
namespace {

constexpr int kEnd = 256, kCodes = 286, kMostBits = 15;
constexpr size_t kMany = 1 << 14;  // symbols: where there are more, `kTold` of each `kOf` say how often they come
constexpr ptrdiff_t kTold = 256, kOf = 8 * kTold;

// Symbols of `Runs` that are not bytes: so many bytes more, as a match of that length; that of two and three longest ones;
// and none.
constexpr int kMatches = 256 - kShortest, kTwice = kMatches + kLongest + 1, kThrice = kTwice + 1, kNothing = kThrice + 1,
              kSymbols = kNothing + 1;

// Writes a run: its byte, the rest of it as far as it is no longest matches, and those. Returns the end; three symbols more
// may be written.
inline uint16_t* put(uint8_t value, uint64_t length, uint16_t* end) {
    int64_t more = int64_t(length) - 1, longest = 0;
    if (more > kLongest) longest = more / kLongest, more %= kLongest;
    const int64_t match = -int64_t(more >= kShortest);  // a mask: which it is cannot be foretold
    end[0] = value, end[1] = uint16_t(value + (match & (kMatches + more - value))), end[2] = value;
    end += more + 1 + (match & (1 - more));
    for (; longest > 0; longest -= 3) *end++ = uint16_t(kMatches + kLongest - 1 + std::min<int64_t>(longest, 3));
    return end;
}

// Bytes to symbols.
inline void widen(const uint8_t* from, uint16_t* to) {
    using Bytes = uint8_t __attribute__((vector_size(Runs::kAtOnce)));
    using Symbols = uint16_t __attribute__((vector_size(2 * Runs::kAtOnce)));
    Bytes bytes;
    std::memcpy(&bytes, from, sizeof bytes);
    const Symbols symbols = __builtin_convertvector(bytes, Symbols);
    std::memcpy(to, &symbols, sizeof symbols);
}

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
            for (int i = 0; i < n; ++i) sizes[used[i] & 0xFFFF] = uint8_t(depth[i]);
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
        word_ |= code.bits << size_;
        size_ += code.size;
        std::memcpy(out_, &word_, 8);
        out_ += size_ / 8;
        word_ >>= size_ / 8 * 8;
        size_ %= 8;
    }
    uint8_t* end() {
        if (size_) put({0, 8 - size_});
        return out_;
    }

 private:
    uint8_t* out_;
    uint64_t word_ = 0;
    int size_ = 0;
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

}  // namespace

// For so many symbols more.
void Runs::reserve(size_t symbols) {
    symbols += count_ + kAtOnce;
    if (symbols > symbols_.size()) symbols_.resize(2 * symbols);
}

void Runs::close() {
    reserve(length_ / kLongest + 4);
    uint16_t* end = &symbols_[count_];
    count_ += size_t(put(value_, length_, end) - end);
    length_ = 0;
}

void Runs::add(const Span* spans, size_t count, const uint8_t* bytes) {
    if (!count) return;
    add(spans[0].value, spans[0].length);
    close();
    size_t room = 0;
    for (size_t i = 0; i < count; ++i) room += spans[i].length / kLongest + 4 + spans[i].n;
    reserve(room);
    uint16_t* __restrict end = &symbols_[count_];
    for (size_t i = 0; i < count; ++i) {
        const Span span = spans[i];
        const uint8_t* __restrict from = bytes + span.at;
        if (i) end = put(span.value, span.length, end);
        if (span.n <= kAtOnce) {
            widen(from, end);
            end += span.n;
        } else {
            count_ = size_t(end - symbols_.data());
            compare(from, span.n);
            end = &symbols_[count_];
        }
    }
    count_ = size_t(end - symbols_.data());
}

// Bytes among which there may be runs.
void Runs::compare(const uint8_t* bytes, uint32_t n) {
    for (uint32_t begin = 0, end = 0; begin < n; begin = end) {
        while (++end < n && bytes[end] == bytes[begin]) {}
        add(bytes[begin], end - begin);
    }
    close();
}

Rows<uint8_t> Runs::zlib(uint32_t checksum) {
    close();
    while (count_ % 4) symbols_[count_++] = kNothing;
    const uint16_t *symbols = symbols_.data(), *end = symbols + count_;
    // Two counts, for the same symbol may come twice in a row.
    uint32_t uses[2][kSymbols] = {};
    const ptrdiff_t step = count_ > kMany ? kOf : kTold;
    for (const uint16_t* from = symbols; from < end; from += step)
        for (const uint16_t *s = from, *to = from + std::min(kTold, end - from); s != to; s += 2) ++uses[0][s[0]], ++uses[1][s[1]];

    Counts counts;
    counts.fill(step > kTold);
    counts[kEnd] = 1;
    for (int s = 0; s < kSymbols; ++s) uses[0][s] += uses[1][s];
    for (int value = 0; value < 256; ++value) counts[value] += uses[0][value];
    for (int length = kShortest; length <= kLongest; ++length) counts[kLengths[length].symbol] += uses[0][kMatches + length];
    counts[kCodes - 1] += 2 * uses[0][kTwice] + 3 * uses[0][kThrice];
    const Sizes sizes = sizes_of(counts);
    const std::array<Code, kCodes> codes = codes_of(sizes);

    std::array<Code, kSymbols> says;
    std::copy_n(codes.begin(), 256, says.begin());
    for (int length = kShortest; length <= kLongest; ++length) {
        const Length& l = kLengths[length];
        says[kMatches + length] = codes[l.symbol].then({l.bits, l.extra}).then({0, 1});
    }
    const Code longest = says[kMatches + kLongest];
    says[kTwice] = longest.then(longest), says[kThrice] = says[kTwice].then(longest);
    says[kNothing] = {0, 0};

    Rows<uint8_t> data(1024 + 8 * count_);
    Bits out(data.data());
    put_head(out, sizes);
    for (const uint16_t* s = symbols; s != end; s += 4) {
        const Code first = says[s[0]].then(says[s[1]]), second = says[s[2]].then(says[s[3]]);
        if (first.size + second.size <= 56) {
            out.put(first.then(second));
        } else {
            for (int i = 0; i < 4; ++i) out.put(says[s[i]]);
        }
    }
    out.put(codes[kEnd]);
    uint8_t* last = out.end();
    for (int shift = 24; shift >= 0; shift -= 8) *last++ = uint8_t(checksum >> shift);
    data.resize(size_t(last - data.data()));
    return data;
}

}  // namespace fracslice
