// Batch by batch, in memory that is used again. Segments whose roots the polish moves far are gathered and
// searched again.
#include "roots.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "features.h"

namespace fracslice::mesh {
namespace {

// Some grid edges as segments.
template <class Real>
void take(Segments<Real>& segments, const GridEdges& edges, const std::vector<uint32_t>& which, Real length, size_t lanes) {
    segments.resize(which.size(), lanes);
    const size_t whole = segments.whole;
    for (size_t k = 0; k < 3; ++k) {
        Real* to = &segments.rows[k * whole];
        for (uint32_t edge : which) *to++ = edges.starts[k][edge];
    }
    Real* directions = std::fill_n(&segments.rows[3 * whole], 3 * whole, Real(0)) - 3 * whole;
    for (size_t i = 0; i < segments.count; ++i) directions[edges.axis(which[i]) * whole + i] = length;
    segments.pad();
}

// Roots of crossings, and rows of normals.
struct RootRows {
    double* t;
    float* normals;
    size_t stride;

    Normal normal(size_t i) const { return {normals[i], normals[i + stride], normals[i + 2 * stride]}; }

    // Whether it is along its edge.
    bool along(size_t axis, size_t i) const {
        Normal n = normal(i);
        return along_axis(n[(axis + 1) % 3], n[(axis + 2) % 3]);
    }

    void put(size_t i, double root, const Normal& normal) const {
        t[i] = root;
        for (size_t k = 0; k < 3; ++k) normals[k * stride + i] = normal[k];
    }
};

// What a leader has found: whether it is in a plane across its edge; how far from an edge's start the field is compared for
// those that it leads, and what it is there for itself.
struct Lead {
    uint32_t edge;
    bool across;
    double t;
    Normal normal;
    Vec3 shift;
    double value;
};

// The edges of a brick, and their leaders.
struct FlatBrick {
    uint32_t edge, edge_end, leader, leader_end;
};

// A brick looks flat where leaders lead this many on average.
constexpr size_t kLed = 10;

// The field is compared so far beside two crossings, in voxels, in no direction that a scene would have: where it is the same
// but for its sign and rounding, so are their distances from a plane and its normals.
constexpr Vec3 kBeside = {3.1e-4, 7.3e-4, 5.9e-4};
constexpr double kSame = 1e-11;

class Search {
  public:
    Search(const CellGrid& cells, const RootLoops& loops, const std::array<double, 3>& origin, double voxel)
        : cells_(cells), loops_(loops), origin_(origin), voxel_(voxel) {}

    void run(size_t begin, size_t end, const RootRows& result) {
        cells_.lay(begin, end, origin_, voxel_, edges_);
        choose();
        each(result);
        follow(result);
        if (!which_.empty()) each(result);
    }

  private:
    // All edges, but only the leaders in bricks that look flat.
    void choose() {
        which_.clear();
        flat_.clear();
        for (size_t k = 0; k + 1 < edges_.bricks.size(); ++k) {
            auto [edge, leader] = edges_.bricks[k];
            auto [edge_end, leader_end] = edges_.bricks[k + 1];
            if (edge_end - edge < kLed * (leader_end - leader)) {
                for (; edge < edge_end; ++edge) which_.push_back(edge);
            } else {
                flat_.push_back({edge, edge_end, leader, leader_end});
                for (; leader < leader_end; ++leader) which_.push_back(edges_.leaders[leader].edge);
            }
        }
    }

    // Copies results of leaders in planes across their edges to the edges that they lead; `which_` is the rest of these.
    void follow(const RootRows& result) {
        look(result);
        which_.clear();
        auto curved = [&](const FlatBrick& brick) {
            uint32_t count = 0;
            for (uint32_t k = brick.leader; k < brick.leader_end; ++k) count += leads_[k].across;
            if (2 * count > brick.leader_end - brick.leader) return false;
            for (uint32_t i = brick.edge; i < brick.edge_end; ++i) add_led(i);
            return true;
        };
        flat_.erase(std::remove_if(flat_.begin(), flat_.end(), curved), flat_.end());
        if (!flat_.empty()) compare(result);
    }

    // Adds an edge to `which_` that is no leader.
    void add_led(uint32_t edge) {
        if (leads_[edges_.led[edge]].edge != edge) which_.push_back(edge);
    }

    // What the leaders of bricks that look flat have found.
    void look(const RootRows& result) {
        leads_.resize(edges_.leaders.size());
        for (const FlatBrick& brick : flat_) {
            for (uint32_t k = brick.leader; k < brick.leader_end; ++k) {
                auto [edge, axis] = edges_.leaders[k];
                leads_[k] = {edge, result.along(axis, edge), result.t[edge], result.normal(edge), voxel_ * kBeside, 0};
                leads_[k].shift[axis] += voxel_ * result.t[edge];
            }
        }
    }

    // The same in bricks that are flat.
    void compare(const RootRows& result) {
        evaluate();
        const double* value = points_.f.data();
        for (const FlatBrick& brick : flat_) {
            for (uint32_t edge = brick.edge; edge < brick.edge_end; ++edge, ++value) {
                Lead& lead = leads_[edges_.led[edge]];
                if (lead.edge == edge) lead.value = *value;
                bool same = std::abs(std::abs(*value) - std::abs(lead.value)) <= kSame * voxel_;
                if (lead.across && same) {
                    result.put(edge, lead.t, (*value < 0) == (lead.value < 0) ? lead.normal : -lead.normal);
                } else {
                    add_led(edge);
                }
            }
        }
    }

    // The field at their edges' shifted places.
    void evaluate() {
        points_.clear();
        for (const FlatBrick& brick : flat_) {
            for (uint32_t i = brick.edge; i < brick.edge_end; ++i) {
                const Vec3& shift = leads_[edges_.led[i]].shift;
                points_.push({edges_.starts[0][i] + shift[0], edges_.starts[1][i] + shift[1], edges_.starts[2][i] + shift[2]});
            }
        }
        points_.evaluate(loops_.field);
    }

    // Looks for each of `which_` by itself.
    void each(const RootRows& result) {
        take(exact_, edges_, which_, voxel_, loops_.lanes);
        fast_.convert(exact_, loops_.lanes);
        loops_.guess(fast_.rows.data(), fast_.out.data(), fast_.whole);
        std::copy(fast_.out.begin(), fast_.out.begin() + ptrdiff_t(fast_.whole), exact_.out.begin());
        loops_.polish(exact_.rows.data(), exact_.out.data(), exact_.whole);
        unsure_.clear();
        for (size_t i = 0; i < exact_.count; ++i) {
            result.put(which_[i], exact_.out[i], normal(exact_, i));
            if (!(moved(exact_, i) <= loops_.sure)) unsure_.push_back(uint32_t(i));
        }
        if (!unsure_.empty()) again(result);
    }

    void again(const RootRows& result) {
        slow_.take(exact_, unsure_, loops_.lanes);
        loops_.find(slow_.rows.data(), slow_.out.data(), slow_.whole);
        roots_.assign(slow_.out.begin(), slow_.out.begin() + ptrdiff_t(slow_.count));
        std::fill(&slow_.out[0] + slow_.count, &slow_.out[0] + slow_.whole, roots_.back());
        loops_.polish(slow_.rows.data(), slow_.out.data(), slow_.whole);
        for (size_t i = 0; i < slow_.count; ++i) {
            double root = moved(slow_, i) <= loops_.sure ? slow_.out[i] : roots_[i];
            result.put(which_[unsure_[i]], root, normal(slow_, i));
        }
    }

    // How far polishing moved a root.
    static double moved(const Segments<double>& of, size_t i) { return of.out[4 * of.whole + i]; }

    static Normal normal(const Segments<double>& of, size_t i) {
        return {float(of.out[of.whole + i]), float(of.out[2 * of.whole + i]), float(of.out[3 * of.whole + i])};
    }

    const CellGrid& cells_;
    const RootLoops& loops_;
    std::array<double, 3> origin_;
    double voxel_;
    GridEdges edges_;
    Segments<double> exact_, slow_;
    Segments<float> fast_;
    std::vector<uint32_t> which_, unsure_;
    std::vector<Lead> leads_;
    std::vector<FlatBrick> flat_;
    std::vector<double> roots_;
    volume::Points points_;
};

}  // namespace

void find_crossings(const CellGrid& cells, const RootLoops& loops, size_t begin, size_t end,
                    const std::array<double, 3>& origin, double voxel, double* t, float* normals, size_t stride) {
    std::vector<size_t> cuts{begin};
    while (cuts.back() < end) cuts.push_back(std::min(cells.end_of_brick(std::min(cuts.back() + loops.batch, end) - 1), end));
    tbb::enumerable_thread_specific<Search> searches([&] { return Search(cells, loops, origin, voxel); });
    tbb::parallel_for(size_t(0), cuts.size() - 1, [&](size_t k) {
        size_t at = cuts[k] - begin;
        searches.local().run(cuts[k], cuts[k + 1], {t + at, normals + at, stride});
    });
}

namespace {

// |f| in voxels: below the first a point needs no projection (a corner has no gradient to follow), below the second it has
// come to the surface.
constexpr double kNear = 1e-9, kConverged = 1e-8;

constexpr size_t kAtOnce = 4096;

// Some points that are away from the surface.
class Projection {
  public:
    Projection(double* points, const ProjectionLoops& loops, const TrustRegions& regions, double voxel)
        : points_(points), loops_(loops), regions_(regions), voxel_(voxel) {}

    void run(size_t first, size_t last) {
        choose(first, last);
        if (which_.empty()) return;
        aim();
        for (size_t i = 0; i < which_.size(); ++i) {
            if (!(miss(exact_, i) * voxel_ < std::abs(values_[i]))) continue;
            for (size_t k = 0; k < 3; ++k) {
                const size_t at = k * exact_.whole + i;
                const double there = exact_.rows[at] + exact_.out[i] * exact_.rows[3 * exact_.whole + at];
                points_[3 * size_t(which_[i]) + k] = std::min(std::max(there, region(0, k, i)), region(1, k, i));
            }
        }
    }

  private:
    // Those of some points that are away from the surface, and the field there.
    void choose(size_t first, size_t last) {
        const size_t n = last - first;
        all_.resize(4 * n);
        for (size_t i = 0; i < n; ++i) {
            for (size_t k = 0; k < 3; ++k) all_[k * n + i] = points_[3 * (first + i) + k];
        }
        loops_.field({&all_[0], &all_[n], &all_[2 * n], &all_[3 * n]}, n);
        which_.clear(), values_.clear();
        for (size_t i = 0; i < n; ++i) {
            const double f = all_[3 * n + i];
            if (std::abs(f) > kNear * voxel_) which_.push_back(int64_t(first + i)), values_.push_back(f);
        }
    }

    // Segments from the points towards the surface, and roots there.
    void aim() {
        exact_.resize(which_.size(), loops_.lanes);
        for (size_t i = 0; i < which_.size(); ++i) {
            for (size_t k = 0; k < 3; ++k) exact_.rows[k * exact_.whole + i] = points_[3 * size_t(which_[i]) + k];
        }
        lead();
        exact_.pad();
        fast_.convert(exact_, loops_.lanes);
        loops_.guess(fast_.rows.data(), fast_.out.data(), fast_.whole);
        std::copy(fast_.out.begin(), fast_.out.begin() + ptrdiff_t(fast_.whole), exact_.out.begin());
        loops_.aim(exact_.rows.data(), exact_.out.data(), exact_.whole);
        unsure_.clear();
        for (size_t i = 0; i < exact_.count; ++i) {
            if (miss(exact_, i) > kConverged) unsure_.push_back(uint32_t(i));
        }
        if (!unsure_.empty()) again();
    }

    // Directions from the points.
    void lead() {
        const size_t n = which_.size(), whole = exact_.whole;
        inside_ = std::make_unique<bool[]>(n);
        for (size_t i = 0; i < n; ++i) inside_[i] = values_[i] < 0;
        box_.resize(12 * n);
        regions_(which_, inside_.get(), box_.data());
        relative_.resize(15 * whole), directions_.resize(3 * whole);
        for (size_t k = 0; k < 3; ++k) {
            for (size_t i = 0; i < whole; ++i) {
                const size_t from = std::min(i, n - 1);
                const double p = exact_.rows[k * whole + from];
                float* to = &relative_[k * whole + i];
                to[0] = float(p);
                to[3 * whole] = float(p - region(0, k, from)), to[6 * whole] = float(region(1, k, from) - p);
                to[9 * whole] = float(region(2, k, from) - p), to[12 * whole] = float(region(3, k, from) - p);
            }
        }
        loops_.lead(relative_.data(), directions_.data(), whole);
        std::copy(directions_.begin(), directions_.end(), exact_.rows.begin() + ptrdiff_t(3 * whole));
    }

    // The roots that have not converged, by the exact field alone.
    void again() {
        slow_.take(exact_, unsure_, loops_.lanes);
        loops_.find(slow_.rows.data(), slow_.out.data(), slow_.whole);
        std::fill(&slow_.out[0] + slow_.count, &slow_.out[0] + slow_.whole, slow_.out[slow_.count - 1]);
        loops_.aim(slow_.rows.data(), slow_.out.data(), slow_.whole);
        for (size_t i = 0; i < slow_.count; ++i) {
            exact_.out[unsure_[i]] = slow_.out[i];
            exact_.out[exact_.whole + unsure_[i]] = miss(slow_, i);
        }
    }

    static double miss(const Segments<double>& of, size_t i) { return of.out[of.whole + i]; }

    double region(size_t part, size_t axis, size_t i) const { return box_[(3 * part + axis) * which_.size() + i]; }

    double* points_;
    const ProjectionLoops& loops_;
    const TrustRegions& regions_;
    double voxel_;
    std::vector<int64_t> which_;
    std::unique_ptr<bool[]> inside_;
    std::vector<double> all_, values_, box_;
    std::vector<float> relative_, directions_;
    Segments<double> exact_, slow_;
    Segments<float> fast_;
    std::vector<uint32_t> unsure_;
};

}  // namespace

void project(double* points, size_t first, size_t last, const ProjectionLoops& loops, const TrustRegions& regions, double voxel) {
    tbb::enumerable_thread_specific<Projection> projections([&] { return Projection(points, loops, regions, voxel); });
    tbb::parallel_for(size_t(0), (last - first + kAtOnce - 1) / kAtOnce, [&](size_t k) {
        const size_t begin = first + k * kAtOnce;
        projections.local().run(begin, std::min(begin + kAtOnce, last));
    });
}

}  // namespace fracslice::mesh
