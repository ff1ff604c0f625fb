#include "projection.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <memory>

namespace fracslice::mesh {
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
