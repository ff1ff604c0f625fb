// Closed rings in the plane as machine code asks for them: signed distances of points.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "distances.h"

namespace fracslice::mesh {

// Negative inside, which is on the left of all segments. The nearest segment is found exactly by a tree of boxes; the side is
// that of the segment, or at a corner that of the sector in which the point lies.
class Outline {
  public:
    static constexpr size_t kAxes = 2;

    // Corners [n, 2] of rings that do not cross, each after the other, and where each ring ends.
    Outline(std::span<const double> corners, std::span<const int64_t> ends);
    Outline(const Outline&) = delete;
    Outline& operator=(const Outline&) = delete;

    const Distances* entry() const { return &entry_; }
    // The distance of a point, which may be infinite. The search begins with a guess, which becomes the segment found.
    double operator()(const double* p, size_t& guess) const;

  private:
    struct Point {
        double x, y;
    };
    struct Segment {
        Point from, to;
        size_t place[2];  // of its corners
    };
    // Where one or more rings have a corner: the other ends of the segments there.
    struct Spoke {
        Point end;
        bool leaves;
    };
    struct Box {
        Point low, high;
    };
    struct Found {
        double square;
        size_t segment;
        int corner;  // 0 or 1, or -1 between them
    };

    void set_places();
    void halve(size_t node, std::span<Segment> segments);
    double to_box(const double* p, const Box& box) const;
    void look(const double* p, size_t segment, Found& best) const;
    Found nearest(const double* p, size_t guess) const;
    bool inside(const double* p, const Found& found) const;

    std::vector<Segment> segments_;  // in the order of the leaves
    size_t leaves_ = 1;
    std::vector<Box> boxes_;      // a heap, as of `Tree`
    std::vector<size_t> first_;   // segment of each leaf, and the end
    std::vector<size_t> spokes_at_;
    std::vector<Spoke> spokes_;
    double wider_ = 0;  // by which boxes are larger, for the rounding of distances
    Distances entry_;
};

}  // namespace fracslice::mesh
