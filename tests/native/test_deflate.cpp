// What is deflated is inflated by zlib to the same bytes.
#include <doctest/doctest.h>
#include <zlib.h>

#include <random>
#include <string>

#include "slices/picture.h"
#include "slices/deflate.h"

namespace fracslice::slices {
namespace {

using Bytes = std::vector<uint8_t>;

Bytes inflated(const Rows<uint8_t>& data, size_t size) {
    Bytes bytes(size + 1);
    uLongf length = bytes.size();
    REQUIRE(uncompress(bytes.data(), &length, data.data(), data.size()) == Z_OK);  // checks the checksum too
    bytes.resize(length);
    return bytes;
}

// Bytes as runs, and what they are deflated to.
struct Stream {
    Runs runs;
    Adler sum;
    Bytes bytes;

    Stream() { runs.clear(); }
    void add(uint8_t value, size_t n) {
        runs.add(value, n);
        sum.add(value, bytes.size(), n);
        bytes.insert(bytes.end(), n, value);
    }
    size_t check() {
        const Rows<uint8_t>& data = runs.zlib(sum.value(bytes.size()));
        CHECK(inflated(data, bytes.size()) == bytes);
        return data.size();
    }
};

}  // namespace

TEST_CASE("runs of every length and byte") {
    for (uint8_t value : {0, 255, 1, 77}) {
        for (size_t n : {1, 2, 3, 4, 257, 258, 259, 260, 261, 262, 516, 517, 774, 1032, 1033, 100000}) {
            Stream stream;
            stream.add(value, n);
            stream.check();
            Stream framed;
            framed.add(9, 1), framed.add(value, n), framed.add(9, 2);
            framed.check();
        }
    }
}

TEST_CASE("equal bytes that are said in parts are one run") {
    Stream one, two;
    one.add(0, 5000), two.add(0, 1234), two.add(0, 5000 - 1234);
    CHECK(one.check() == two.check());
    CHECK(one.check() < 400);
}

TEST_CASE("no bytes at all") {
    Stream stream;
    stream.check();
}

TEST_CASE("random runs, few and many symbols") {
    std::mt19937 random(1);
    for (int most : {2, 10, 300, 5000}) {
        for (size_t runs : {10u, 1000u, 30000u}) {
            Stream stream;
            std::uniform_int_distribution<int> length(1, most), value(0, 255);
            for (size_t i = 0; i < runs && stream.bytes.size() < 3000000; ++i) {
                const int next = value(random);
                stream.add(uint8_t(i % 3 ? next : next % 2 * 255), size_t(length(random)));
            }
            stream.check();
        }
    }
}

TEST_CASE("codes are no longer than 15 bits where counts grow as Fibonacci's numbers") {
    Stream stream;
    size_t a = 1, b = 1;
    for (int value = 1; value < 26; ++value) {
        for (size_t i = 0; i < a; ++i) stream.add(uint8_t(value), 1), stream.add(uint8_t(value + 100), 1);
        b = std::exchange(a, a + b);
    }
    stream.check();
}

TEST_CASE("a cut run: zeros or 255s before up to eight bytes; and bytes among which there are runs") {
    std::mt19937 random(2);
    std::uniform_int_distribution<int> value(0, 255);
    Runs runs;
    runs.clear();
    Bytes bytes;
    Runs::End end = runs.reserve(100000, 100000);
    for (int i = 0; i < 500; ++i) {
        uint8_t some[2 * Runs::kAtOnce];
        for (uint8_t& byte : some) byte = uint8_t(value(random));
        const uint8_t before = i % 2 ? 255 : 0;
        const size_t n = size_t(value(random)) + 1;
        end.add(before, n);
        bytes.insert(bytes.end(), n, before);
        const int count = 1 + i % Runs::kAtOnce;
        if (i % 3)
            end.cut(some, count);
        else
            end.mixed(some, count);
        bytes.insert(bytes.end(), some, some + count);
    }
    runs.set(end);
    CHECK(inflated(runs.zlib(uint32_t(adler32(1, bytes.data(), uInt(bytes.size())))), bytes.size()) == bytes);
}

TEST_CASE("the checksum of tiles in any order") {
    constexpr int rows = 5, tiles = 9, stride = 8 * (tiles + 8);
    std::mt19937 random(3);
    std::uniform_int_distribution<int> value(0, 255);
    std::vector<uint8_t> levels(rows * stride);
    int columns[tiles + 8] = {};
    for (int tile = 0; tile < tiles; ++tile) columns[tile] = 8 * tile;
    for (int row = 0; row < rows; ++row) {
        for (int i = 0; i < 8 * tiles; ++i) levels[size_t(row * stride + i)] = uint8_t(value(random));
    }
    Bytes bytes(100, 7);  // what comes before them
    for (int row = 0; row < rows; ++row) bytes.insert(bytes.end(), &levels[size_t(row * stride)], &levels[size_t(row * stride)] + 8 * tiles);
    Sums sums;
    add_bytes(levels.data(), stride, rows, columns, tiles, sums);
    Adler sum;
    sum.add(sums, 100, 8 * tiles, rows);
    sum.add(7, 0, 100);
    CHECK(sum.value(bytes.size()) == adler32(1, bytes.data(), uInt(bytes.size())));
}

}  // namespace fracslice::slices
