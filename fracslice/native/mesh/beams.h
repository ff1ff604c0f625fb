// Beams between points as machine code asks for them: signed distances of points.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "distances.h"

namespace fracslice::mesh {

// Each beam is all balls between one at each of its ends, of radii that change evenly. The distance is the least of the exact
// ones of all beams, which are found by a tree of boxes; with a seam it is the f of
//     sum over chains of max(0, f + seam - distance)^2 = seam^2,
// which is the distance of one chain of beams where the others are farther off by the seam, is less where they are not, and has a
// Lipschitz constant of 1, as its gradient is a weighted mean of theirs.
class Beams {
  public:
    static constexpr size_t kAxes = 3;

    // Balls [n, 2, 4] of at least one beam, the centre of each end and its radius; and the chain of each beam, between which and
    // others of its own there is no seam.
    Beams(std::span<const double> balls, std::span<const int32_t> chains, double seam);
    Beams(const Beams&) = delete;
    Beams& operator=(const Beams&) = delete;

    const Distances* entry() const { return &entry_; }
    // The distance of a point; NaN where it is not finite. The search begins with a beam, which becomes the nearest one.
    double operator()(const double* p, size_t& found) const;

  private:
    struct Beam {
        double from[3], axis[3];  // a unit vector
        double length, radius, slope;  // radius at the start, and by how much it shrinks along the axis
        double apart;  // by how much the nearest ball is nearer to the start than a point is, per distance from the axis
        double low[3], high[3];
        int32_t chain;
    };
    struct Box {
        double low[3], high[3];
    };

    static Beam beam_of(const double* balls);
    void halve(size_t node, std::span<Beam> beams);
    double to_beam(const double* p, size_t beam) const;
    double to_box(const double* p, const Box& box) const;
    double blended(const double* p, double nearest) const;
    // Calls look(beam) for all beams of boxes nearer than a limit, which may shrink, the nearer half first or in their order.
    template <class Look>
    void search(const double* p, const double& limit, bool sorted, const Look& look) const;

    std::vector<Beam> beams_;  // in the order of the leaves
    size_t leaves_ = 1;
    std::vector<Box> boxes_;  // a heap, as of `Tree`
    std::vector<size_t> first_;  // beam of each leaf, and the end
    double seam_;
    double wider_ = 0;  // by which boxes are larger, for the rounding of distances
    Distances entry_;
};

}  // namespace fracslice::mesh
