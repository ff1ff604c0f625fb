// The samples around the contours of a few neighbouring layers, one after the other, from the field.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "bits.h"
#include "samples.h"

namespace fracslice::slices {

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

// The samples of a layer, tile by tile. Neighbouring layers share the coarse probes.
//
// Top down, blocks of 64, 32 and 16 pixels over all layers, of 8 over groups of some and of 4 over pairs, then samples: one
// of each block of 2, and the others. A value decides all samples within its reach; in an escape-time field it is calm where all
// around has one sign, and less is enough. Then closure: where two neighbours differ in sign and one of them is only implied,
// it is evaluated, until no such pair is left. So every edge that the contour crosses has two evaluated ends.
class Slab : private Tiles {
 public:
    // ny, nx: lattice points. z: of the layers, scene units.
    Slab(std::shared_ptr<Memory> memory, std::shared_ptr<const Field> field, const ProbeBounds& bounds, const Frame& frame,
         std::vector<double> z, int ny, int nx);
    Slab(const Slab&) = delete;
    ~Slab() { memory_->give(std::move(*this)); }

    // Finds the tiles of a layer and lets go of those of the one before; they do not depend on which others were sampled.
    // Throws std::domain_error where the solid reaches the rim of the lattice.
    void sample(int layer);
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
    void begin();
    void probe();
    void list(const Chunk& chunk, uint64_t among);
    void probe(const Chunk& chunk, int size, uint64_t among);
    void set(const Ask& ask, uint64_t negative, uint64_t reached, uint64_t within);
    void twos();
    void calm();
    void rest();

    int32_t add(int y, int x);
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

    std::shared_ptr<Memory> memory_;
    std::shared_ptr<const Field> field_;
    ProbeBounds bounds_;
    Frame frame_;
    std::vector<double> z_;
    std::vector<std::array<int, 2>> groups_, pairs_;  // first and last of layers that share blocks of 8 pixels, or of 4
    std::vector<float> x_, y_;               // of lattice points
    std::optional<Discs> discs_, centres_;  // in fields that are not of escape time alone
    double diagonal_;  // of a pixel, squared, in lesser steps
    std::vector<Block> blocks_;  // of 16 pixels, that are not decided
    Rows<Column> columns_;         // of the group
    Rows<Four> quarters_;          // of the pair
    Open open_;
    std::optional<std::vector<Place>> torn_;  // of that group, once they are known
    int group_ = -1, pair_ = -1, layer_ = -1;  // their first layers; the layer
    std::vector<float> middles_;   // values in the middles of places, NaN between uses
    std::vector<uint64_t> decided_;  // of opened tiles: samples that are evaluated or implied by a value in reach
    Rows<Ask> asks_;  // for use within a step
    // Of tiles in an escape-time field: the signs of blocks of 2, and of those in their rows; the blocks whose value is enough where
    // it is calm.
    std::vector<uint32_t> halves_, rows_;
    std::vector<uint64_t> enough_;
    int ty_, tx_;
    float scale_ = 0;
    int64_t evaluations_ = 0;
};

}  // namespace fracslice::slices
