// Layers of beams, without samples: where lines of the lattice enter and leave each beam.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "slab.h"

namespace fracslice::slices {

// From where to where a line is in a solid, scene units; nowhere if it ends before it begins.
struct Interval {
    double begin, end;
};

// All balls between one at each end, of radii that change evenly.
class Beam {
 public:
    // balls [2, 4]: the centre of each end and its radius.
    explicit Beam(const double* balls);

    // The box of its section at a height, by x and y, or a little more; both are empty if it has none.
    std::array<Interval, 2> box(double z) const;
    // Of the line along x (axis 0) or y (axis 1), the other coordinate of which is `at`.
    Interval chord(int axis, double at, double z) const;

 private:
    std::array<double, 3> from_, axis_;  // the axis a unit vector
    double length_, radius_, slope_;     // radius at the start, and by how much it shrinks along the axis
    double steep_;                       // the square of its secant
    double low_, high_;
    std::array<std::array<double, 4>, 2> ends_;  // balls that show at the ends
};

// What supports are made of: beams that a floor cuts off, and a convex plate below it.
struct Beams {
    std::vector<Beam> beams;
    double floor;
    std::vector<std::array<double, 4>> plate;  // half spaces that it is in, a x + b y + c z <= d; none if there are none

    // balls [n, 2, 4], planes [k, 4].
    Beams(std::span<const double> balls, double floor, std::span<const double> planes);
};

// Convex solids cross each line once, so that samples need not be looked for.
class BeamSlab : public Slab {
 public:
    BeamSlab(std::shared_ptr<Memory> memory, std::shared_ptr<const Beams> beams, const Frame& frame, std::vector<double> z, int ny,
             int nx);

    void sample(int layer) override;

 private:
    // A line's part in a solid, in steps of the lattice; along x the line is a row, along y a column.
    struct Span {
        int32_t line, beam;
        double begin, end;
        int32_t first() const;  // sample within
        int32_t last() const;
    };

    // What is known of a tile: edges whose crossing is, along x and y, and cells that a beam's outline goes through.
    struct Known {
        std::array<uint64_t, 2> crossed{};
        uint64_t curved = 0;
    };

    void cut(int axis);
    void put(int axis, int32_t line, int32_t beam, const Interval& part);
    void fill(const Span& row);
    void surround();
    void cross(int axis, const Span& span);
    void turn();
    void bend();
    bool is_inside(int32_t row, int32_t column) const;

    std::shared_ptr<const Beams> beams_;
    std::array<int, 2> samples_;  // along x and y
    std::array<std::vector<Span>, 2> spans_;  // along x and y
    std::vector<std::array<double, 2>> widths_;  // of the section of each beam, half of them; of the plate 0
    std::vector<Known> known_;  // of each tile; the curvature of outlines is in `values`, by cells
};

}  // namespace fracslice::slices
