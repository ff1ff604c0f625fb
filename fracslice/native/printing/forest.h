// Branches that carry the tips of supports: where they meet, and their ways down through the free cells of a grid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fracslice::printing {

using Point = std::array<double, 3>;

// Cells around an object, [z, y, x]; lengths in mm.
struct Room {
    const uint8_t* away;  // steps from the nearest cell with a part of the object
    const float* cost;    // length of the shortest way down to the plate
    std::array<int64_t, 3> shape;
    Point origin, cell;  // corner of the first cell, sides
    double floor;

    size_t at(const Point& point) const;
    // Whether all cells along a segment are as many steps away from the object.
    bool is_free(const Point& start, const Point& end, int least) const;
    // The first corner of the shortest way from a point down to the plate, or its end; `wide` and `narrow` as below.
    Point corner(const Point& start, int wide, int narrow) const;

  private:
    std::array<int64_t, 3> cells(const Point& point) const;  // x, y, z
    Point straight(const std::vector<Point>& way, int least) const;
};

// What branches are led by.
struct Manners {
    int wide, narrow;  // steps from which on a way is free, and those of a way through a narrow place
    double farthest, lowest, foot;  // longest branch, least height of a meeting above the floor, cost of a foot, mm
    size_t tries;                   // meetings that are tried
};

struct Grown {
    std::vector<Point> places;    // of the nodes, those of the tips first
    std::vector<int64_t> down;    // next node on the way down; -1 if it is straight down to the plate, or on a trunk
    std::vector<int64_t> trunks;  // nodes from which it is straight down to the plate
    std::vector<int64_t> on;      // trunk on which a branch ends at the node; -1 if none
};

// From the highest node down, each is led to another one, to a trunk or by its own way.
Grown grow_forest(const Room& room, const Manners& manners, const std::vector<Point>& ends);

}  // namespace fracslice::printing
