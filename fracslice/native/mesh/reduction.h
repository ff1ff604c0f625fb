// Vertices taken out of a closed mesh as long as it stays near all of them: half-edge collapses under error control (Klein,
// Liebich and Strasser, "Mesh Reduction with Error Control", 1996), which can be undone.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "../array.h"
#include "nearest.h"
#include "topology.h"

// The triangles around a vertex, and what they become when it moves to one of its neighbours.
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

class Reduction {
  public:
    // Of a closed, oriented 2-manifold, which outlives this. Every vertex stays within the tolerance.
    Reduction(const MeshView& mesh, double tolerance);

    // All vertices are looked at by the next sweeps.
    void renew();
    // Takes out those of the vertices first to last - 1 that may go with an error of at most a share of the tolerance; none next
    // to one that the same sweep took out, which begins with first = 0. Only vertices are looked at around which something has
    // changed since they could not go. Returns how many went.
    size_t sweep(size_t first, size_t last, double share);
    // Puts back what was taken out last at each triangle at fault: [count]. These vertices are taken out again only at a quarter
    // of the tolerance, and if they come back once more, never.
    void undo(const bool* faulty);

    // What the triangles have become; whether they are out; the step that changed each last, 0 for those that are as they were;
    // what has changed since the state before. Of each vertex a triangle near it, -1 if it never was part of one.
    struct State {
        Array<int32_t> triangles;
        Array<bool> gone;
        Array<int32_t> step;
        Array<bool> fresh;
        Array<int32_t> owner;
    };
    State state();

  private:
    // A vertex of the original; the triangles of a star that it is near before and after a move.
    struct Near {
        int32_t vertex;
        int before, after;
    };

    bool take_out(size_t u, double limit);
    double fits(const Fan& fan, double limit);
    void gather(const Star& star);
    void place(const Star& star, int Near::*where);
    void put(int32_t v, int32_t t);
    void changed(const Star& star);
    void look_again(int32_t v);

    MeshView mesh_;
    double tolerance_;
    CornerTable table_;
    // The vertices near a triangle are a list: first_[t], next_[first_[t]], and so on.
    std::vector<int32_t> owner_, first_, next_;
    std::vector<uint8_t> due_, fresh_;
    // Of each vertex: the share of the tolerance it may have; the sweep that last changed something around it; the square of an
    // error that taking it out would at least make.
    std::vector<float> trust_, least_;
    std::vector<int32_t> busy_;
    int32_t sweep_ = 0;
    std::vector<Near> points_;
};

}  // namespace fracslice::mesh
