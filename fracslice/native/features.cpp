// Passes over the bricks, each brick by itself: which cells have tips, and where their faces may have corners; then which of
// these are corners, for both cells must have tips.
#include "features.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <utility>

#include "faces.h"

namespace fracslice {
namespace {

// Where one thread finds features and keeps them.
class Store {
  public:
    std::vector<Array<Feature>> blocks;

    // Notes a feature in a cell's lower face along axis 0, 1 or 2, or in the cell (3).
    void add(int axis, const Feature& feature) { found_[axis][count_[axis]++] = feature; }

    // Keeps what was found in a brick and is ready for the next one.
    void keep(Features& of) {
        size_t count = 0;
        for (size_t some : count_) count += some;
        if (count > room_) {
            room_ = std::max(count, kBlock);
            blocks.emplace_back(room_, 1);
            next_ = blocks.back().data.get();
        }
        of.points = next_;
        of.count = uint32_t(count);
        for (int axis = 0; axis < 4; ++axis) {
            next_ = std::copy(found_[axis].begin(), found_[axis].begin() + std::exchange(count_[axis], 0), next_);
        }
        room_ -= count;
    }

  private:
    static constexpr size_t kBlock = size_t(1) << 18;
    std::array<std::array<Feature, kSamples>, 4> found_;
    std::array<size_t, 4> count_{};
    Feature* next_ = nullptr;
    size_t room_ = 0;
};

// What is known of a crossing; a brick's are laid side by side, for its cells look at each up to four times.
struct Datum {
    double t;
    Normal normal;
};

// The ends of a feature in a cell's lower face along axis 0, 1 or 2, or in the cell (3), by case and the octant it is in: the
// corner with fewest steps to that octant's, of either sign.
using Ends = std::array<std::array<std::array<uint8_t, 8>, 256>, 4>;

constexpr Ends make_ends() {
    Ends ends{};
    for (int axis = 0; axis < 4; ++axis) {
        for (int number = 0; number < 256; ++number) {
            for (int octant = 0; octant < 8; ++octant) {
                int least[2] = {4, 4}, nearest[2] = {0, 0};
                for (int k = 0; k < 8; ++k) {
                    int outside = !(number >> k & 1), d = k ^ octant, steps = (d & 1) + (d >> 1 & 1) + (d >> 2);
                    if (k >> axis & 1 || steps >= least[outside]) continue;
                    least[outside] = steps, nearest[outside] = k;
                }
                ends[axis][number][octant] = uint8_t(nearest[0] | nearest[1] << 3);
            }
        }
    }
    return ends;
}
constexpr Ends kEnds = make_ends();

uint8_t ends_of(const Cell& cell, const Vec3& point, int axis) {
    int octant = 0;
    for (int k = 0; k < 3; ++k) octant |= int(point[k] - cell.lower[k] > 0.5) << k;
    return kEnds[axis][cell.number][octant];
}

// The features of one brick.
class Finder {
  public:
    Finder(const CellGrid& cells, const Crossed& crossed, double margin, size_t i) : near_(cells, i), margin_(margin) {
        uint32_t seen = 0;
        cells.for_each_near(near_.octant, [&](size_t at, uint32_t vertex) {
            near_.numbers[at] = seen;
            data_[seen++] = {crossed.root(vertex), crossed.normal(vertex)};
        });
    }

    void find(Features& own, Store& store) {
        near_.for_each([&](const Cell& cell) {
            const Case& type = kCases[cell.number];
            Vec3 tip;
            if (!bent(cell) || !(place(cell), feature_point(loop_.data(), type.loop_length, cell.lower, margin_, tip))) {
                own.loops += type.triangles;
                return;
            }
            own.loops += type.loop_length;
            own.tips[cell.x] |= cell.bit();
            store.add(3, {tip, ends_of(cell, tip, 3)});
            for (int axis = 0; axis < 3; ++axis) {
                Vec3 corner;
                if (!corner_in(cell, axis, corner)) continue;
                own.corners[axis][cell.x] |= cell.bit();
                store.add(axis, {corner, ends_of(cell, corner, axis)});
            }
        });
        store.keep(own);
    }

  private:
    // Whether two normals of a cell's loop of crossings make a feature.
    bool bent(const Cell& cell) const {
        const Case& type = kCases[cell.number];
        std::array<const Datum*, sizeof(Case::loop)> loop;
        double least = 1;
        for (int a = 0; a < type.loop_length; ++a) {
            loop[a] = &data_[cell.at(type.loop[a])];
            least = std::min(least, dot(loop[0]->normal, loop[a]->normal));
        }
        if (least > kHalfSharp) return false;
        bool found = least < kSharp;
        for (int a = 2; a < type.loop_length && !found; ++a) {
            for (int b = 1; b < a; ++b) found |= dot(loop[a]->normal, loop[b]->normal) < kSharp;
        }
        return found;
    }

    // Lays a cell's loop of crossings out.
    void place(const Cell& cell) {
        const Case& type = kCases[cell.number];
        for (int a = 0; a < type.loop_length; ++a) {
            const Edge& edge = kEdges[type.loop[a]];
            const Datum& datum = data_[cell.at(type.loop[a])];
            Crossing& to = loop_[a];
            to.point = cell.lower + Vec3{double(edge.dx), double(edge.dy), double(edge.dz)};
            to.point[edge.axis] += datum.t;
            for (int k = 0; k < 3; ++k) to.normal[k] = datum.normal[k];
        }
    }

    // The corner of the trace in a cell's lower face along `axis`, if there is one. A face that the loop passes twice has
    // none: two could cross.
    bool corner_in(const Cell& cell, int axis, Vec3& corner) const {
        int k = kFaces[cell.number].lower[axis];
        if (k < 0) return false;
        const Crossing &a = loop_[k], &b = loop_[k + 1 < kCases[cell.number].loop_length ? k + 1 : 0];
        return sharp(a, b) && face_corner(a, b, axis, cell.lower, margin_, corner);
    }

    Near near_;
    double margin_;
    std::array<Datum, std::tuple_size<Numbers>::value> data_;
    std::array<Crossing, sizeof(Case::loop)> loop_;
};

// The slab read one step against y or z; `before` is the slab of the neighbour on that side.
Slab from_y(Slab slab, Slab before) { return slab << 8 | before >> 56; }
Slab from_z(Slab slab, Slab before) { return (slab << 1 & ~kFirstZ) | (before >> 7 & kFirstZ); }

// Keeps the corners between two cells with tips, and numbers them. below: the brick's neighbours on the lower sides.
void choose(Features& own, const std::array<const Features*, 3>& below) {
    const Feature* from = own.points;
    Feature* to = own.points;
    for (int axis = 0; axis < 3; ++axis) {
        Signs none{}, before = below[axis] ? below[axis]->tips : none;
        for (int x = 0; x < kSide; ++x) {
            Slab tips = own.tips[x], other = axis == 0   ? (x ? own.tips[x - 1] : before[kSide - 1])
                                             : axis == 1 ? from_y(tips, before[x])
                                                         : from_z(tips, before[x]);
            for (Slab bits = own.corners[axis][x]; bits; bits &= bits - 1, ++from) {
                if (bits & -bits & other) *to++ = *from;
            }
            own.corners[axis][x] &= other;
            own.rank[axis][x] = uint16_t(own.corner_count);
            own.corner_count += uint32_t(__builtin_popcountll(own.corners[axis][x]));
        }
    }
    to = std::copy(from, const_cast<const Feature*>(own.points + own.count), to);
    own.count = uint32_t(to - own.points);
}

}  // namespace

Crossed::Crossed(const CellGrid& cells, Layers layers, const Hermite& data, double margin)
    : data_(data), margin_(margin), first_(cells.crossings_before(layers.first - 1)) {
    size_t wanted = cells.crossings_before(layers.last + 2) - first_;
    if (data.count != wanted) {
        throw std::invalid_argument("expected " + std::to_string(wanted) + " crossings, found " + std::to_string(data.count));
    }
}

FeatureGrid::FeatureGrid(const CellGrid& cells, Layers layers, const Crossed& crossed, double margin)
    : cells_(cells), near_(cells.span({layers.first - 1, layers.last + 1})), features_(near_.size()) {
    tbb::enumerable_thread_specific<Store> stores;
    for_each_brick(near_, [&](size_t i) { Finder(cells, crossed, margin, i).find(of(i), stores.local()); });
    for (Store& store : stores) std::move(store.blocks.begin(), store.blocks.end(), std::back_inserter(blocks_));
    for_each_brick(cells.span({layers.first, layers.last + 1}), [&](size_t i) {
        Features& own = of(i);
        if (own.count) choose(own, {beside(i, 0, -1), beside(i, 1, -1), beside(i, 2, -1)});
    });
}

const Features* FeatureGrid::beside(size_t i, int axis, int step) const {
    Place to = cells_.place(i);
    to[axis] += step;
    int64_t at = cells_.find(to, 0, 0, 0);
    return at >= 0 ? &of(size_t(at)) : nullptr;
}

}  // namespace fracslice
