// Tiles of samples, and memory for them that is used again.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace fracslice::slices {

constexpr int kTile = 8;
constexpr uint64_t kAll = ~uint64_t(0);
// Two tiles stand for all that no contour enters.
constexpr int32_t kFull = 0, kEmpty = 1, kTiles = 2;

// A vector whose new elements are left uninitialised.
template <class T>
struct Uninitialised : std::allocator<T> {
    template <class U>
    struct rebind {
        using other = Uninitialised<U>;
    };
    template <class U>
    void construct(U*) noexcept {}
    template <class U, class... A>
    void construct(U* p, A&&... a) {
        ::new (static_cast<void*>(p)) U(std::forward<A>(a)...);
    }
};
template <class T>
using Rows = std::vector<T, Uninitialised<T>>;

// Where a tile is, and which of the two that stand for all others would be there without it.
struct Place {
    int32_t y, x, otherwise;
};

// Tiles of 8 x 8 samples: words of 64 bits and 64 values; bit 8 * row + column belongs to the sample at
// (8 (x - 1) + column, 8 (y - 1) + row). The sign of a sample that is not known is implied by one near it.
struct Tiles {
    std::vector<int32_t> where;  // the tile at each place, row by row
    std::vector<Place> place;
    std::vector<std::array<int32_t, 4>> beside;  // to the right, to the left, above and below; not of the two
    std::vector<uint64_t> inside, known;
    Rows<std::array<float, 64>> values;
    // The share of the edge before its crossing, of `kWhole`: of the edge from each sample to its right, then of the one
    // upwards.
    Rows<std::array<uint16_t, 128>> cross;
    // The cells of each tile that corners and bends change, and the area that they add to the inside, pixels.
    std::vector<uint64_t> sharp;
    Rows<std::array<float, 64>> tips;

    size_t count() const { return place.size(); }
    void push(const Place& at, uint64_t signs);
    void grow(size_t n);  // by n tiles without a place and without known samples
    void clear(size_t places);  // all of them empty
    void drop(size_t first, int columns);  // the tiles from there on; columns: of places
    void cut(size_t n);         // to the first n
};

// Memory of tiles that are gone, for those to come: laying new pages would take as long as sampling. For many threads.
class Memory {
 public:
    Tiles take(size_t places);
    // Returns tiles that were taken; never allocates.
    void give(Tiles&& tiles) noexcept;

 private:
    std::mutex mutex_;
    std::vector<Tiles> free_;
    size_t lent_ = 0;
};

// The samples of a tile within a distance of a place in it, by its square in units of the lesser step.
class Discs {
 public:
    // aside: how far middles are to the right and above, in steps.
    Discs(double dx, double dy, double aside);
    // d2: not negative.
    uint64_t operator()(float d2, int bit) const { return discs_[d2 < kMost ? int(d2) : kMost][bit]; }

 private:
    static constexpr int kMost = 32;
    std::array<std::array<uint64_t, 64>, kMost + 1> discs_;
};

}  // namespace fracslice::slices
