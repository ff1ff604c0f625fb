#include "deflate.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace fracslice {
namespace {

constexpr int kEnd = 256, kSymbols = 286, kMostBits = 15;
constexpr uint32_t kMost = (1 << 23) - 1;     // longest matches of a part
constexpr uint32_t kModulus = 65521;

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
    lengths[kLongest] = {kSymbols - 1, 0, 0};
    return lengths;
}();

using Counts = std::array<uint64_t, kSymbols>;
using Sizes = std::array<uint8_t, kSymbols>;

// How many bits each symbol takes (Huffman 1952), at most 15: rare ones are made less rare until they do.
Sizes sizes_of(Counts counts) {
    std::vector<int> used;
    for (int s = 0; s < kSymbols; ++s)
        if (counts[s]) used.push_back(s);
    const int n = int(used.size());
    std::vector<uint64_t> weight(2 * n - 1);
    std::vector<int> parent(2 * n - 1), depth(2 * n - 1);
    for (;;) {
        std::sort(used.begin(), used.end(), [&](int a, int b) { return counts[a] != counts[b] ? counts[a] < counts[b] : a < b; });
        for (int i = 0; i < n; ++i) weight[i] = counts[used[i]];
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
        if (*std::max_element(depth.begin(), depth.begin() + n) <= kMostBits) break;
        for (int s : used) counts[s] = counts[s] / 2 + 1;
    }
    Sizes sizes{};
    for (int i = 0; i < n; ++i) sizes[used[i]] = uint8_t(depth[i]);
    return sizes;
}

struct Code {
    uint64_t bits;
    int size;

    Code then(uint64_t more, int wide) const { return {bits | more << size, size + wide}; }
};

// The canonical codes of those sizes, first bit lowest.
std::array<Code, kSymbols> codes_of(const Sizes& sizes) {
    std::array<Code, kSymbols> codes{};
    uint32_t next = 0;
    for (int size = 1; size <= kMostBits; ++size, next <<= 1)
        for (int s = 0; s < kSymbols; ++s)
            if (sizes[s] == size) {
                uint64_t bits = 0;
                for (int b = 0; b < size; ++b) bits |= uint64_t(next >> b & 1) << (size - 1 - b);
                codes[s] = {bits, size};
                ++next;
            }
    return codes;
}

// Bits after bits, the first lowest.
class Bits {
 public:
    explicit Bits(uint8_t* out) : out_(out) {}
    // At most 56.
    void put(const Code& code) {
        word_ |= code.bits << size_;
        size_ += code.size;
        std::memcpy(out_, &word_, 8);
        out_ += size_ / 8;
        word_ >>= size_ / 8 * 8;
        size_ %= 8;
    }
    void repeat(const Code& code, uint32_t n) {
        Code many{0, 0};
        const uint32_t at_once = 56 / code.size;
        for (uint32_t i = 0; i < at_once; ++i) many = many.then(code.bits, code.size);
        for (; n >= at_once; n -= at_once) put(many);
        for (; n; --n) put(code);
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
    out.put({kSymbols - 257, 5});
    out.put({0, 5});
    out.put({19 - 4, 4});
    constexpr int order[] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    for (int s : order) out.put({s < 16 ? 4u : 0u, 3});
    auto put_size = [&](int size) {
        uint64_t bits = 0;
        for (int b = 0; b < 4; ++b) bits |= uint64_t(size >> b & 1) << (3 - b);
        out.put({bits, 4});
    };
    for (uint8_t size : sizes) put_size(size);
    put_size(1);
}

// With d_i the n bytes: 1 + sum d_i, and n + sum (n - i) d_i, modulo 65521 (RFC 1950), run by run.
class Adler {
 public:
    void add(uint64_t value, uint64_t length) {
        sum_ += value * length;
        weighted_ += value * (length * at_ + length * (length - 1) / 2);
        at_ += length;
        if (++adds_ % 1024 == 0 || length > kLongest) sum_ %= kModulus, weighted_ %= kModulus, at_ %= kModulus;
    }
    uint32_t value() const {
        const uint64_t sum = sum_ % kModulus, at = at_ % kModulus;
        return uint32_t((at + at * sum + kModulus - weighted_ % kModulus) % kModulus << 16 | (1 + sum) % kModulus);
    }

 private:
    uint64_t at_ = 0, sum_ = 0, weighted_ = 0;  // modulo 65521, now and then
    uint32_t adds_ = 0;
};

}  // namespace

void Runs::split() {
    if (!length_) return;
    uint64_t more = length_ - 1, longest = more / kLongest;
    more %= kLongest;
    for (; more > 0 && more < kShortest; --more) parts_.push_back({value_, 0, 0});
    parts_.push_back({value_, uint32_t(more), 0});
    for (; longest > 0; longest -= std::min<uint64_t>(longest, kMost))
        parts_.push_back({value_, uint32_t(std::min<uint64_t>(longest, kMost)), 1});
}

std::vector<uint8_t> Runs::zlib() {
    close();
    std::array<uint32_t, 256> literals{};
    std::array<uint64_t, kLongest + 1> matches{};
    Adler sum;
    for (const Part& part : parts_) {
        literals[part.value] += !part.longest;
        matches[part.longest ? kLongest : part.more] += part.longest ? part.more : 1;
        sum.add(part.value, part.length());
    }
    Counts counts{};
    counts[kEnd] = 1;
    std::copy(literals.begin(), literals.end(), counts.begin());
    for (int length = kShortest; length <= kLongest; ++length) counts[kLengths[length].symbol] += matches[length];
    const Sizes sizes = sizes_of(counts);
    const std::array<Code, kSymbols> codes = codes_of(sizes);
    std::array<Code, kLongest + 1> again{};  // none of no length
    for (int length = kShortest; length <= kLongest; ++length) {
        const Length& l = kLengths[length];
        again[length] = codes[l.symbol].then(l.bits, l.extra).then(0, 1);
    }

    uint64_t bits = 8 * 256;
    for (int s = 0; s < kSymbols; ++s) bits += counts[s] * (sizes[s] + 6);
    std::vector<uint8_t> data(bits / 8);
    Bits out(data.data());
    put_head(out, sizes);
    for (const Part& part : parts_) {
        if (part.longest) {
            out.repeat(again[kLongest], part.more);
        } else {
            const Code &first = codes[part.value], &rest = again[part.more];
            out.put(first.then(rest.bits, rest.size));
        }
    }
    out.put(codes[kEnd]);
    uint8_t* end = out.end();
    for (int shift = 24; shift >= 0; shift -= 8) *end++ = uint8_t(sum.value() >> shift);
    data.resize(size_t(end - data.data()));
    return data;
}

}  // namespace fracslice
