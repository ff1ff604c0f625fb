#include "nesting.h"

#include <cmath>
#include <vector>

#include "predicates.h"

namespace fracslice::mesh {
namespace {

// 1 if the ray up from p leaves through the triangle, -1 if it enters, else 0.
int winding_of(const MeshView& mesh, size_t t, const double* p) {
    int turn = 0;
    for (int k = 0; k < 3; ++k) {
        const double *a = mesh.corner(t, k), *b = mesh.corner(t, (k + 1) % 3);
        bool up = a[1] <= p[1] && p[1] < b[1], down = b[1] <= p[1] && p[1] < a[1];
        if (!up && !down) continue;
        int side = side_of_line(a[0], a[1], b[0], b[1], p[0], p[1]);
        turn += (up && side > 0) - (down && side < 0);
    }
    if (turn == 0) return 0;
    return side_of_plane(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), p) * turn > 0 ? turn : 0;
}

class Rays {
  public:
    Rays(const MeshView& mesh, const TreeView& tree, const int32_t* labels, size_t shells)
        : mesh_(mesh), tree_(tree), labels_(labels), around_(shells, 0), met_(shells, false) {}

    // Calls found(shell, winding) for every shell about a point.
    template <class Found>
    void cast(const double* p, const Found& found) {
        stack_.assign(1, 1);
        while (!stack_.empty()) {
            size_t node = stack_.back();
            stack_.pop_back();
            if (!passes(node, p)) continue;
            if (node < tree_.leaves) {
                stack_.insert(stack_.end(), {2 * node, 2 * node + 1});
            } else {
                add_leaf(node - tree_.leaves, p);
            }
        }
        for (int32_t shell : seen_) {
            if (around_[shell] != 0) found(shell, around_[shell]);
            around_[shell] = 0;
            met_[shell] = false;
        }
        seen_.clear();
    }

  private:
    bool passes(size_t node, const double* p) const {
        const double *low = tree_.low + 3 * node, *high = tree_.high + 3 * node;
        return low[0] <= p[0] && p[0] <= high[0] && low[1] <= p[1] && p[1] <= high[1] && p[2] <= high[2];
    }

    void add_leaf(size_t leaf, const double* p) {
        for (size_t i = tree_.first(leaf); i < tree_.last(leaf); ++i) {
            int turn = winding_of(mesh_, size_t(tree_.order[i]), p);
            if (turn == 0) continue;
            int32_t shell = labels_[tree_.order[i]];
            if (!met_[shell]) seen_.push_back(shell);
            met_[shell] = true;
            around_[shell] += turn;
        }
    }

    const MeshView& mesh_;
    const TreeView& tree_;
    const int32_t* labels_;
    std::vector<int64_t> around_;
    std::vector<bool> met_;
    std::vector<int32_t> seen_;
    std::vector<size_t> stack_;
};

}  // namespace

Nesting nesting(const MeshView& mesh, const TreeView& tree, const int32_t* labels, const double* sizes,
                const int64_t* first, size_t shells) {
    Nesting nested{{shells, 1}, {shells, 1}};
    Rays rays(mesh, tree, labels, shells);
    for (size_t shell = 0; shell < shells; ++shell) {
        int64_t &winding = nested.winding.data[shell] = 0, &parent = nested.parent.data[shell] = -1;
        if (first[shell] < 0) continue;
        rays.cast(mesh.point(int32_t(first[shell])), [&](int32_t other, int64_t around) {
            if (size_t(other) == shell) return;
            winding += around;
            if (parent < 0 || sizes[other] < sizes[parent]) parent = other;
        });
    }
    return nested;
}

}  // namespace fracslice::mesh
