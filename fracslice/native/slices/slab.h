// The samples around the contours of a few neighbouring layers, from the field.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace fracslice {

constexpr int kTile = 8;
constexpr int32_t kEmpty = -1, kFull = -2;
constexpr float kWhole = 32768;
constexpr uint64_t kAll = ~uint64_t(0);

inline uint16_t share_of(float share) { return uint16_t(share * kWhole + 0.5f); }

// What is sampled; may be called from many threads.
class Field {
 public:
    virtual ~Field() = default;
    // Values at n points, n a multiple of 64, the arrays contiguous.
    virtual void values(const float* x, const float* y, const float* z, float* f, size_t n) const = 0;
};

// Where lattice points lie, scene units: x0 + dx * column, y0 + dy * row.
struct Frame {
    double x0, y0, dx, dy;
};

// How far a value reaches: a block is decided where |f| exceeds a bound times the distance to its farthest sample.
struct Bounds {
    double proven;           // for blocks of 16 pixels and more, and whole tiles if nothing better is known
    double outside, inside;  // for tiles and what is in them, by the value's sign
    int stop_outside, stop_inside;  // blocks of so many samples are not cut any more
    bool even;  // a fractal: values inside are of another scale than outside, one in the whole slab; see `halve`
};

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

struct Place {
    int32_t layer, y, x;
};

// A place on the lattice.
struct Spot {
    double column, row;
};

// Tiles of 8 x 8 samples: two words of 64 bits, *inside* and *known*, and 64 values; bit 8 * row + column belongs to the
// sample at (8 (x - 1) + column, 8 (y - 1) + row). The sign of a sample that is not known is implied by a probe near it.
//
// Top down, blocks of 64, 32 and 16 pixels over all layers, of 8 over half of them, then tiles of each layer, and in tiles
// blocks of 4, 2 and 1; every probe from tiles down is a sample itself. Then closure: where two neighbours differ in sign
// and one of them is only implied, it is evaluated, until no such pair is left. So every edge that the contour crosses has
// two evaluated ends.
class Slab {
 public:
    // ny, nx: lattice points. z: of the layers, scene units. wanted: those that are sampled; their samples do not depend on
    // which others are.
    Slab(const Frame& frame, std::vector<double> z, std::vector<int> wanted, int ny, int nx);

    // Finds all tiles; once. Throws std::domain_error where the solid reaches the rim of the lattice.
    void sample(const Field& field, const Bounds& bounds);

    int layers() const { return int(z_.size()); }
    int rows() const { return ty_; }      // of `where`, its rim included
    int columns() const { return tx_; }
    // The row of the tile at a place, or kEmpty or kFull where none is needed; the rim is empty.
    int32_t at(int layer, int y, int x) const { return where_[(size_t(layer) * ty_ + y) * tx_ + x]; }
    size_t count() const { return place.size(); }

    // The inside word at a place, implied where there is no tile.
    uint64_t word(int layer, int y, int x) const {
        int32_t t = at(layer, y, x);
        return t >= 0 ? inside[t] : t == kFull ? kAll : 0;
    }

    // The value of sample (row, column) of a tile, each 0 to 8; for evaluated samples.
    float value(const Place& p, int32_t tile, int row, int column) const {
        if (row < kTile && column < kTile) return values[tile][kTile * row + column];
        int32_t other = at(p.layer, p.y + (row >> 3), p.x + (column >> 3));
        return other >= 0 ? values[other][kTile * (row & 7) + (column & 7)] : 0.f;
    }

    std::vector<Place> place;
    // The tiles of each layer, from the first of a pair to before the second.
    std::vector<std::array<int32_t, 2>> span;
    std::vector<uint64_t> inside, known;
    Rows<std::array<float, 64>> values;
    // The share of the edge before its crossing, of `kWhole`: of the edge from each sample to its right, then of the one
    // upwards.
    Rows<std::array<uint16_t, 128>> cross;
    // The cells of each tile that a corner changes, and by how much of their area.
    std::vector<uint64_t> sharp;
    float tip(int32_t tile, int bit) const;
    int64_t evaluations = 0;

 private:
    struct Block {
        int y, x, size, first, last;
    };
    // A crossed edge: of which sample, to its right or (64 more) upwards, and the values at its ends.
    struct Edge {
        int32_t tile, number;
        float first, second;

        float out() const { return first > second ? first : second; }
        float in() const { return first > second ? second : first; }
    };
    // What a corner adds to the inside of a cell, in pixels; `cell` is 64 * tile + bit.
    struct Tip {
        int64_t cell;
        float area;
    };

    template <class Where, class Take>
    void evaluate(const Field& field, size_t n, const Where& where, const Take& take);
    template <class Take>
    void evaluate(const Field& field, const std::vector<int64_t>& samples, const Take& take);
    std::vector<float> values_at(const Field& field, int layer, const std::vector<Spot>& spots);

    int32_t add(int layer, int y, int x);
    std::vector<Block> coarse(const Field& field, const Bounds& bounds);
    void fill(const Block& block);
    void tiles(const Field& field, const Bounds& bounds, const std::vector<Block>& blocks, int layer);
    double likely(const Bounds& bounds, const float* middle) const;
    void finer(const Field& field, const Bounds& bounds, int size);
    void mend(int layer);
    void close(const Field& field);
    void ask(std::vector<int32_t>& active, std::vector<uint8_t>& marked, std::vector<int64_t>& samples);
    void corners();
    void measure(const Field& field, const Bounds& bounds, int layer);
    void halve(const Field& field, const std::vector<Edge>& edges);
    static float inside_scale(const std::vector<Edge>& edges, const std::vector<float>& middle);
    void settle(const Field& field, int layer, const std::vector<Edge>& edges);
    void sharpen(const Field& field, int layer);
    void put_tip(int layer, int row, int column, float area);

    Frame frame_;
    std::vector<double> z_;
    std::vector<int> wanted_;  // ascending
    std::vector<float> outside_;  // of each tile, the bound for outside values in it
    std::vector<Tip> tips_;       // ascending
    size_t first_ = 0;         // tile of the layer that is sampled
    int ty_, tx_;
    std::vector<int32_t> where_;
};

}  // namespace fracslice
