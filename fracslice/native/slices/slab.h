// The samples around the contours of a few neighbouring layers, one after the other.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

// Words of 64 signs: shifts that bring each sample's neighbour to its place.
namespace fracslice::slices {

constexpr uint64_t kFirstColumn = 0x0101010101010101, kLastColumn = 0x8080808080808080;
constexpr uint64_t kFirstRow = 0xFF, kLastRow = 0xFF00000000000000;

// The sign of the sample to the right of each, to the left of it, above and below it; `beside`: the word of the tile there.
inline uint64_t rights(uint64_t word, uint64_t beside) { return (word >> 1 & ~kLastColumn) | (beside << 7 & kLastColumn); }
inline uint64_t lefts(uint64_t word, uint64_t beside) { return (word << 1 & ~kFirstColumn) | (beside >> 7 & kFirstColumn); }
inline uint64_t uppers(uint64_t word, uint64_t beside) { return word >> 8 | beside << 56; }
inline uint64_t lowers(uint64_t word, uint64_t beside) { return word << 8 | beside >> 56; }

// visit(bit) for each bit of a word, ascending.
template <class Visit>
inline void each(uint64_t word, const Visit& visit) {
    for (; word; word &= word - 1) visit(std::countr_zero(word));
}

// The word with each row's columns from right to left, and with rows as columns (Warren 2012, "Hacker's Delight", 7-3).
inline uint64_t mirrored(uint64_t w) {
    w = (w >> 1 & 0x5555555555555555) | (w & 0x5555555555555555) << 1;
    w = (w >> 2 & 0x3333333333333333) | (w & 0x3333333333333333) << 2;
    return (w >> 4 & 0x0F0F0F0F0F0F0F0F) | (w & 0x0F0F0F0F0F0F0F0F) << 4;
}
inline uint64_t transposed(uint64_t w) {
    auto swap = [&](uint64_t mask, int by) {
        uint64_t t = (w ^ w >> by) & mask;
        w ^= t ^ t << by;
    };
    swap(0x00AA00AA00AA00AA, 7);
    swap(0x0000CCCC0000CCCC, 14);
    swap(0x00000000F0F0F0F0, 28);
    return w;
}

// Eight words of eight bytes: the first bytes of all become the first word, and so on.
inline void swap_rows_and_columns(std::span<uint64_t, 8> w) {
    auto swap = [&](int apart, uint64_t mask) {
        for (int i = 0; i < 8; ++i) {
            if (i & apart) continue;
            uint64_t t = (w[i] >> 8 * apart ^ w[i + apart]) & mask;
            w[i + apart] ^= t, w[i] ^= t << 8 * apart;
        }
    };
    swap(4, 0x00000000FFFFFFFF);
    swap(2, 0x0000FFFF0000FFFF);
    swap(1, 0x00FF00FF00FF00FF);
}

// The samples of odd rows and columns, a row of four in each byte; and such samples as the blocks of 2 x 2 that end there.
inline uint32_t halved(uint64_t w) {
    w = w >> 9 & 0x0055005500550055;
    w = (w | w >> 1) & 0x0033003300330033, w = (w | w >> 2) & 0x000F000F000F000F;
    w |= w >> 8;
    return uint32_t(w & 0xFFFF) | uint32_t(w >> 32) << 16;
}
inline uint64_t doubled(uint32_t halves) {
    uint64_t w = (halves & 0xFFFF) | uint64_t(halves & 0xFFFF0000) << 16;
    w = (w | w << 8) & 0x00FF00FF00FF00FF;
    w = (w | w << 2) & 0x0033003300330033, w = (w | w << 1) & 0x0055005500550055;
    return w * 0x0303;
}
// Those of the first four rows and columns of which five rows and columns from there on are all ones.
inline uint32_t all_of_five(uint64_t w) {
    uint64_t row = w & w >> 1;
    row &= row >> 2 & w >> 4;
    uint64_t all = row & row >> 8;
    all &= all >> 16 & row >> 32;
    return uint32_t(all) & 0x0F0F0F0F;
}

// The samples of a block of size x size, the first of a tile.
constexpr uint64_t block(int size) {
    uint64_t line = (uint64_t(1) << size) - 1, word = 0;
    for (int row = 0; row < size; ++row) word |= line << 8 * row;
    return word;
}

// --- Tiles of samples, and memory for them that is used again.

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

// --- Samples of tiles as a list, and their signs back in the tiles.

// Samples of a tile.
struct Ask {
    int32_t tile;
    uint64_t samples;
};

// Those whose values are negative, those whose values are beyond a rim, and those that are so where it is calm.
struct Signs {
    uint64_t negative, beyond, calm;
};

// What squared values are compared with: `least`, once they are scaled by a factor for inside, or of their tile for outside.
// Where it is calm, less is enough outside, and any value inside.
struct Rim {
    float inside;
    const float* outside;
    float least, calm;
};

constexpr size_t kSlack = 64;  // numbers that `gather` may write and `scatter` may read behind the last one

// Where samples lie: x by columns and y by rows of the lattice, in the order of tiles and bits.
void gather(std::span<const Ask> asks, const Tiles& tiles, const float* x, const float* y, float* to_x, float* to_y);

// The values `f` of the same samples, into the tiles. rim: null if none is beyond.
void scatter(std::span<const Ask> asks, const float* f, const Rim* rim, Tiles& tiles, Signs* result);

constexpr float kWhole = 32768;

inline uint16_t share_of(float share) { return uint16_t(share * kWhole + 0.5f); }

// The field to sample; called from many threads.
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

// Lipschitz bounds of values: points nearer than |f| over a bound have the sign of f.
struct ProbeBounds {
    double proven;           // for blocks of 16 pixels and more, and of 8 if nothing better is known
    double outside, inside;  // for smaller ones, by the value's sign
    bool escape_time_only;  // values inside are of another scale than outside, of one scale in a layer, see `inside_scale`
};

// A place on the lattice.
struct Spot {
    double column, row;
};

// The tiles of a few neighbouring layers, one layer after the other.
class Slab : protected Tiles {
 public:
    Slab(const Slab&) = delete;
    virtual ~Slab() { memory_->give(std::move(*this)); }

    // Finds the tiles of a layer and lets go of those of the one before; they do not depend on which others were sampled.
    // Throws std::domain_error where the solid reaches the rim of the lattice.
    virtual void sample(int layer) = 0;
    int layer() const { return layer_; }  // the one whose tiles there are; -1 of none

    int layers() const { return int(z_.size()); }
    int rows() const { return ty_; }  // of places, their rim included
    int columns() const { return tx_; }
    // The tile at a place; the rim is empty. Those to its right and above are 1 and `columns` further.
    const int32_t* spot(int y, int x) const { return &where[size_t(y) * tx_ + x]; }
    int32_t at(int y, int x) const { return *spot(y, x); }
    // The inside word at a place, implied where there is no tile.
    uint64_t word(int y, int x) const { return inside[at(y, x)]; }

    // visit(number, first, second) for each crossed edge from the samples `of` a tile, with the values at its ends.
    template <class Visit>
    void crossed(int32_t tile, uint64_t of, const Visit& visit) const {
        const int32_t next = beside[tile][0], over = beside[tile][2];
        const float *own = values[tile].data(), *right = values[next].data(), *upper = values[over].data();
        uint64_t s = inside[tile], across = (s ^ rights(s, inside[next])) & of, up = (s ^ uppers(s, inside[over])) & of;
        each(across & ~kLastColumn, [&](int bit) { visit(bit, own[bit], own[bit + 1]); });
        each(across & kLastColumn, [&](int bit) { visit(bit, own[bit], right[bit - 7]); });
        each(up & ~kLastRow, [&](int bit) { visit(64 + bit, own[bit], own[bit + 8]); });
        each(up & kLastRow, [&](int bit) { visit(64 + bit, own[bit], upper[bit - 56]); });
    }

    const Tiles& tiles() const { return *this; }
    // How many times smaller inside values are than outside ones; 0 where `cross` says where edges are crossed.
    float scale() const { return scale_; }
    // The inside area of a cell with the corner or bend that it has.
    float sharpened(int32_t tile, int bit, float area) const {
        return sharp[tile] >> bit & 1 ? std::clamp(area + tips[tile][bit], 0.f, 1.f) : area;
    }
    int64_t evaluations() const { return evaluations_; }  // of the field, so far

 protected:
    // ny, nx: lattice points. z: of the layers, scene units.
    Slab(std::shared_ptr<Memory> memory, const Frame& frame, std::vector<double> z, int ny, int nx);

    void begin(int layer);  // the one to be sampled
    int32_t add(int y, int x);

    std::shared_ptr<Memory> memory_;
    Frame frame_;
    std::vector<double> z_;
    int layer_ = -1;
    int ty_, tx_;
    float scale_ = 0;
    int64_t evaluations_ = 0;
};

// The samples of a field, which neighbouring layers share the coarse probes of.
//
// Top down, blocks of 64, 32 and 16 pixels over all layers, of 8 over groups of some and of 4 over pairs, then samples: one
// of each block of 2, and the others. A value decides all samples within its reach; in an escape-time field it is calm where all
// around has one sign, and less is enough. Then closure: where two neighbours differ in sign and one of them is only implied,
// it is evaluated, until no such pair is left. So every edge that the contour crosses has two evaluated ends.
class FieldSlab : public Slab {
 public:
    FieldSlab(std::shared_ptr<Memory> memory, std::shared_ptr<const Field> field, const ProbeBounds& bounds, const Frame& frame,
              std::vector<double> z, int ny, int nx);

    void sample(int layer) override;

 private:
    struct Block {
        int y, x, size;
    };
    // A place whose tiles are open from layer to layer: the value in its middle, and how far outside values around it reach.
    struct Column {
        int y, x;
        float value, reach;
    };
    // The values in the middles of a place's quarters.
    using Four = float __attribute__((vector_size(16)));
    // The tiles of a pair before a layer is sampled, see `Tiles`.
    struct Open {
        std::vector<std::array<int32_t, 4>> beside;
        std::vector<uint64_t> inside, decided;
        std::vector<float> reach;  // of outside values: how far they do, squared, as a factor
    };
    // The middles of crossed edges, and how many times the values outside are those inside.
    struct Middles {
        std::vector<float> x, y, quotients;
    };
    // Tiles.
    struct Chunk {
        int32_t first, last;
    };
    // A crossed edge: of which sample, to its right or (64 more) upwards, and the values at its ends.
    struct Edge {
        int32_t tile, number;
        float first, second;
    };

    template <class Where, class Take>
    void evaluate(size_t n, const Where& where, const Take& take);
    template <class Take>
    void evaluate(const Rows<Ask>& asks, const Rim* rim, const Take& take);
    std::vector<float> values_at(const std::vector<Spot>& spots);

    std::vector<Block> coarse();
    void fill(const Block& block);
    void columns(int first, int last);
    void quarter(double z);
    void open(double height);
    void reopen();
    void probe();
    void list(const Chunk& chunk, uint64_t among);
    void probe(const Chunk& chunk, int size, uint64_t among);
    void set(const Ask& ask, uint64_t negative, uint64_t reached, uint64_t within);
    void twos();
    void calm();
    void rest();

    void mend();
    std::vector<Place> torn() const;
    void close();
    struct Differing;
    bool is_closed() const;  // whether every edge that the contour crosses has two evaluated ends
    void ask(std::vector<int32_t>& active, std::vector<int32_t>& again);
    void enlarge(int32_t t, std::vector<int32_t>& active, std::vector<int32_t>& again);
    void corners();

    std::vector<Edge> edges() const;
    Middles middles(int32_t step) const;
    float inside_scale();
    void project(const std::vector<Edge>& edges);
    void sharpen();
    void put_tip(int row, int column, float area);

    std::shared_ptr<const Field> field_;
    ProbeBounds bounds_;
    std::vector<std::array<int, 2>> groups_, pairs_;  // first and last of layers that share blocks of 8 pixels, or of 4
    std::vector<float> x_, y_;               // of lattice points
    std::optional<Discs> discs_, centres_;  // in fields that are not of escape time alone
    double diagonal_;  // of a pixel, squared, in lesser steps
    std::vector<Block> blocks_;  // of 16 pixels, that are not decided
    Rows<Column> columns_;         // of the group
    Rows<Four> quarters_;          // of the pair
    Open open_;
    std::optional<std::vector<Place>> torn_;  // of that group, once they are known
    int group_ = -1, pair_ = -1;  // their first layers
    std::vector<float> middles_;   // values in the middles of places, NaN between uses
    std::vector<uint64_t> decided_;  // of opened tiles: samples that are evaluated or implied by a value in reach
    Rows<Ask> asks_;  // for use within a step
    // Of tiles in an escape-time field: the signs of blocks of 2, and of those in their rows; the blocks whose value is enough where
    // it is calm.
    std::vector<uint32_t> halves_, rows_;
    std::vector<uint64_t> enough_;
};

// --- The field at many points at a time.

constexpr size_t kBatch = 2048;
constexpr double kSurely = 0.99999;  // squared distances are rounded

// Squared distances in units of the lesser step, from squared values.
inline float factor(double bound, const Frame& frame) {
    const double reach = bound * std::min(frame.dx, frame.dy);
    return float(kSurely / (reach * reach));
}

// Points, and what the field is there.
struct Batch {
    alignas(64) float x[kBatch + kSlack], y[kBatch + kSlack], z[kBatch + kSlack], f[kBatch + kSlack];

    void values(const Field& field, size_t n) {
        size_t padded = (n + 63) / 64 * 64;
        std::fill(x + n, x + padded, x[0]), std::fill(y + n, y + padded, y[0]), std::fill(z + n, z + padded, z[0]);
        field.values(x, y, z, f, padded);
        // NaN counts as outside.
        for (size_t i = 0; i < n; ++i) f[i] = f[i] == f[i] ? f[i] : 1;
    }
};

// where(i, x, y, z) sets the place of point i, scene units; take(i, f) gets its value.
template <class Where, class Take>
void FieldSlab::evaluate(size_t n, const Where& where, const Take& take) {
    Batch batch;
    evaluations_ += int64_t(n);
    for (size_t begin = 0; begin < n; begin += kBatch) {
        size_t m = std::min(kBatch, n - begin);
        for (size_t i = 0; i < m; ++i) where(begin + i, batch.x[i], batch.y[i], batch.z[i]);
        batch.values(*field_, m);
        for (size_t i = 0; i < m; ++i) take(begin + i, batch.f[i]);
    }
}

// Of samples; keeps the values. take(ask, signs) for each tile.
template <class Take>
void FieldSlab::evaluate(const Rows<Ask>& asks, const Rim* rim, const Take& take) {
    Batch batch;
    std::array<Signs, kBatch> result;
    std::fill(batch.z, batch.z + kBatch, float(z_[layer_]));
    for (size_t begin = 0, end = 0; begin < asks.size(); begin = end) {
        size_t n = 0;
        for (; end < asks.size() && n + kTile * kTile <= kBatch; ++end) n += size_t(std::popcount(asks[end].samples));
        const std::span some(&asks[begin], end - begin);
        gather(some, *this, x_.data(), y_.data(), batch.x, batch.y);
        batch.values(*field_, n);
        evaluations_ += int64_t(n);
        scatter(some, batch.f, rim, *this, result.data());
        for (size_t i = begin; i < end; ++i) take(asks[i], result[i - begin]);
    }
}

}  // namespace fracslice::slices
