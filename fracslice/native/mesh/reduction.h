// Vertices taken out of a closed mesh as long as it stays near all of them: half-edge collapses under error control (Klein,
// Liebich and Strasser, "Mesh Reduction with Error Control", 1996), which can be undone.
#pragma once
#include <vector>

#include "../array.h"
#include "corner_table.h"
#include "fan.h"

namespace fracslice::mesh {

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
