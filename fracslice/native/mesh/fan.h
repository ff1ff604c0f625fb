// The triangles around a vertex, and what they become when it moves to one of its neighbours.
#pragma once
#include <cmath>
#include <limits>

#include "corner_table.h"
#include "distance.h"

namespace fracslice::mesh {

class Fan {
  public:
    Fan(const Star& star, const double* positions, const double* vertex) : count(star.count), vertex_(vertex) {
        for (int i = 0; i < count; ++i) ring_[i] = ring_[i + count] = positions + 3 * size_t(star.ring[i]);
        for (int i = 0; i < count; ++i) before_[i] = {vertex, ring_[i], ring_[i + 1]};
    }

    // Moves the vertex to ring[i] of the star; triangle a of 1 to count - 2 then has the corners ring[i], ring[i + a] and
    // ring[i + a + 1]. Returns the shape of the worst, 1 if all are regular; -1 if one turns over or is thinner than `thin`.
    double move(int i, double thin) {
        to_ = i;
        double worst = 1;
        for (int a = 1; a < count - 1; ++a) {
            TriangleDistance& after = after_[a] = {ring_[i], ring_[i + a], ring_[i + a + 1]};
            double area = after.square_area(), sides = after.square_sides();
            if (area <= thin * thin * sides || turns(before_[(i + a) % count], after)) return -1;
            worst = std::min(worst, area / (sides * sides));
        }
        return std::sqrt(12 * worst);
    }

    // The square of the vertex's distance from where it was.
    double error() const {
        double least = kInfinity;
        for (int a = 1; a < count - 1; ++a) least = std::min(least, after_[a].square(vertex_));
        return least;
    }

    // A triangle near a point, which was near triangle s before; -1 if none is within the limit, and then the least distance.
    // Distances are squares.
    int near(const double* p, int s, double limit, double& least) const {
        int a = std::clamp((s - to_ + count) % count, 1, count - 2);
        least = kInfinity;
        for (int low = a, high = a + 1; low > 0 || high < count - 1; --low, ++high) {
            for (int b : {low, high}) {
                if (b < 1 || b > count - 2) continue;
                double d = after_[b].square(p);
                if (d <= limit) return b;
                least = std::min(least, d);
            }
        }
        return -1;
    }

    // The triangle nearest to a point before the move.
    int nearest(const double* p) const {
        double least = kInfinity;
        int result = 0;
        for (int i = 0; i < count; ++i) {
            if (double d = before_[i].square(p); d < least) least = d, result = i;
        }
        return result;
    }

    // Whether the middles of new edges are within a distance, given by its square, of the old triangles: no hole without points
    // in it is bridged.
    bool covered(double limit) const {
        for (int a = 2; a < count - 1; ++a) {
            double middle[3];
            for (int k = 0; k < 3; ++k) middle[k] = (ring_[to_][k] + ring_[to_ + a][k]) / 2;
            if (std::none_of(before_, before_ + count, [&](const auto& t) { return t.square(middle) <= limit; })) return false;
        }
        return true;
    }

    const int count;

  private:
    // The least cosine between a triangle's normals before and after a move.
    static constexpr double kTurn = 0.2, kInfinity = std::numeric_limits<double>::infinity();

    static bool turns(const TriangleDistance& before, const TriangleDistance& after) {
        double m[3], n[3];
        before.normal(m), after.normal(n);
        double cosine = m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
        return cosine <= 0 || cosine * cosine <= kTurn * kTurn * before.square_area() * after.square_area();
    }

    int to_ = 0;
    const double *vertex_, *ring_[2 * kDegree];
    TriangleDistance before_[kDegree], after_[kDegree];
};

}  // namespace fracslice::mesh
