#include "quantise.h"

#include <cmath>

#include "blocks.h"

namespace fracslice::mesh {
namespace {

float rounded(double x) { return float(x) + 0.0f; }  // -0 becomes 0

// Whether rounding keeps all planes apart.
bool apart(const Planes& planes) {
    for (size_t i = 1; i < planes.count; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            if (!(rounded(planes(i - 1, axis)) < rounded(planes(i, axis)))) return false;
        }
    }
    return planes.count > 1;
}

// Finds the planes of one axis that a coordinate lies between.
class Axis {
  public:
    Axis(const Planes& planes, int axis)
        : planes_(planes), axis_(axis), first_(planes(0, axis)),
          scale_(double(planes.count - 1) / (planes(planes.count - 1, axis) - first_)) {}

    // Whether rounding keeps it in its plane, or between the same two.
    bool keeps(double x) const {
        size_t last = planes_.count - 1;
        double place = (x - first_) * scale_;
        size_t i = place > 0 ? std::min(size_t(place), last) : 0;
        while (i > 0 && at(i) > x) --i;
        while (i < last && at(i + 1) <= x) ++i;
        if (at(i) == x) return true;
        return at(i) < x && i < last && rounded(at(i)) < rounded(x) && rounded(x) < rounded(at(i + 1));
    }

  private:
    double at(size_t i) const { return planes_(i, axis_); }

    const Planes& planes_;
    int axis_;
    double first_, scale_;
};

}  // namespace

Quantised quantise(const double* points, size_t count, const Planes& planes) {
    Quantised found{{count, 3}, {count, 1}};
    bool known = apart(planes);
    std::atomic<bool> finite = true;
    for_each_block(count, [&](size_t, size_t first, size_t last) {
        bool all = true;
        for (size_t i = 3 * first; i < 3 * last; ++i) {
            found.points.data[i] = double(rounded(points[i]));
            all &= std::isfinite(found.points.data[i]);
        }
        if (!all) finite.store(false, std::memory_order_relaxed);
        std::fill(&found.displaced.data[first], &found.displaced.data[first] + (last - first), !known);
        for (int k = 0; known && all && k < 3; ++k) {
            Axis axis(planes, k);
            for (size_t v = first; v < last; ++v) found.displaced.data[v] |= !axis.keeps(points[3 * v + size_t(k)]);
        }
    });
    found.finite = finite;
    return found;
}

}  // namespace fracslice::mesh
