// Extreme points of a solid in given directions, by pattern search (Hooke and Jeeves 1961).
#pragma once
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "field_values.h"

namespace fracslice::volume {

// The steps of a direction, and what each gains; the same number and gains for all directions.
struct Steps {
    const double *x, *y, *z;  // [directions][steps]
    const double* gain;       // [steps]
    size_t count;
};

// Moves interior points outwards as far as possible: a step is taken if it ends inside, the one that gains most; if none of a
// direction's points moves, its step length is halved, from `first` until it is below `exact`. points[k] is row k of
// [directions][starts]. Points are evaluated in blocks, on the threads of the arena.
void climb(const FieldValues& field, const std::array<double*, 3>& points, size_t directions, size_t starts, const Steps& steps,
           double first, double exact);

// --- Proven bounds of an object on one side, by free balls. fracslice/volume/extent.py says how sides are used.
//
// Seen from that side, the object stands in columns, each with a ceiling above which it is proven empty. A free ball, of
// radius f / L around a point, lowers the ceiling of a column that it spans; a column that it does not span is split in four.
// The highest ceilings are processed first, so that a wall on a plate is found before any work is spent on the plate. From
// high above a flat face a ball spans a wide column and still comes near the face: where values are distances, some thousand
// balls prove it.

using Point = std::array<double, 3>;

// What can be asked of a field: its sign, and the radius of a free ball.
struct FreeSpace {
    const FieldValues& sign;          // inside where < 0
    const FieldValues& conservative;  // its values divided by `lipschitz` are radii of free balls
    double lipschitz;
    bool far;  // these radii are nearly maximal, from far away too
};

// Columns: centre across, width as a fraction of the initial one, ceiling.
struct Columns {
    std::vector<double> u, v, width, top;

    size_t size() const { return top.size(); }
    void push(double a, double b, double w, double t) { u.push_back(a), v.push_back(b), width.push_back(w), top.push_back(t); }
    void push(const Columns& from, size_t i) { push(from.u[i], from.v[i], from.width[i], from.top[i]); }
};

constexpr size_t kBest = 4;  // highest interior points kept

// One side of the object within a box. Heights are measured along `axis`, outwards by `sign`.
class Side {
  public:
    Side(const Point& lo, const Point& hi, int axis, int sign);

    // Adds an interior point; one that is not a number is ignored.
    void learn(const Point& point);
    // Searches for tips with a fraction of the Lipschitz bound.
    void guess(const FreeSpace& field, double share, double aim, size_t most);
    // Lowers the ceilings to `aim` above the highest interior point. About `most` columns are processed at most.
    void prove(const FreeSpace& field, double aim, size_t most);

    const std::array<Point, kBest>& best() const { return best_; }  // the highest first; NaN where none is known
    double known() const { return known_; }                         // height of the highest interior point
    double above() const { return above_; }                         // height that nothing is above
    size_t spent() const { return spent_; }                         // columns processed

  private:
    Point point(double u, double v, double height) const;
    bool high(double ceiling, double aim) const;
    void lower(const FreeSpace& field, const Columns& front, double aim);
    void drop(const FreeSpace& field, const Columns& front, const std::vector<double>& heights, std::vector<double>& lower);
    void probe(const FreeSpace& field, const Columns& stuck);
    double radius(double width) const { return width * radius_; }

    int axis_, sign_;
    Point lo_, hi_;
    std::array<double, 2> half_;  // of an initial column, across
    double floor_, above_, longest_, radius_;
    std::array<Point, kBest> best_;
    double known_ = -std::numeric_limits<double>::infinity();
    size_t spent_ = 0;
    Columns columns_;
    Points points_;  // kept between calls
};

// Rows of coordinates with any strides, and their placement: scale * p + offset, for a point p in scene units.
struct PlacedPoints {
    const double* data;
    ptrdiff_t row, column;
    double scale;
    std::array<double, 3> offset;

    double at(size_t i, size_t axis) const { return (data[ptrdiff_t(i) * row + ptrdiff_t(axis) * column] - offset[axis]) / scale; }
};

// Steps of finite differences, all of one length: along the axes, against them, and along 20 diagonals.
struct Differences {
    const double* steps;  // [26, 3]
    double length;
};

// |f| over the steepest difference, at most a voxel. The steps against the axes are taken only where those along them are
// flat, and the diagonals where both are.
void surface_error(const FieldValues& field, const PlacedPoints& points, const Differences& differences, double voxel,
                   std::span<double> errors);

}  // namespace fracslice::volume
