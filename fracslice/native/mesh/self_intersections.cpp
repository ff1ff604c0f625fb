// From the root down each node hands its children those nodes of the same level that their boxes meet. Pairs are looked at
// once: at the node of the lower number.
#include "self_intersections.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <bit>
#include <vector>

#include "boxes.h"
#include "overlap.h"

namespace fracslice::mesh {
namespace {

// Leaves of a task.
constexpr size_t kTask = 256;

class Pairs {
  public:
    Pairs(const MeshView& mesh, const TreeView& tree, const bool* among)
        : mesh_(mesh), tree_(tree), among_(among), holds_(2 * tree.leaves, !among), aspects_(mesh.count), marks_(mesh.count) {
        tbb::parallel_for(size_t(0), mesh.count, [&](size_t t) { aspects_[t] = aspect_of(mesh, t); });
        for (size_t i = 0; among && i < tree.count; ++i) holds_[tree.leaves + i / kLeaf] |= among[tree.order[i]];
        for (size_t node = tree.leaves; among && --node > 0;) holds_[node] = holds_[2 * node] | holds_[2 * node + 1];
    }

    Array<bool> run();

  private:
    // What one thread needs.
    class Search;

    bool meet(size_t a, size_t b) const {
        const double *low = tree_.low, *high = tree_.high;
        bool separate = !holds_[a] && !holds_[b];
        for (int k = 0; k < 3; ++k) separate |= (low[3 * a + k] > high[3 * b + k]) | (high[3 * a + k] < low[3 * b + k]);
        return !separate;
    }

    bool asked(size_t s, size_t t) const { return !among_ || among_[s] || among_[t]; }
    bool marked(size_t t) const { return marks_[t].load(std::memory_order_relaxed); }
    void mark(size_t t) { marks_[t].store(true, std::memory_order_relaxed); }

    const MeshView& mesh_;
    const TreeView& tree_;
    const bool* among_;
    std::vector<uint8_t> holds_;  // for each node whether some of its triangles are asked about
    std::vector<Aspect> aspects_;
    std::vector<std::atomic<bool>> marks_;
};

class Pairs::Search {
  public:
    explicit Search(Pairs& pairs) : pairs_(pairs), mesh_(pairs.mesh_), tree_(pairs.tree_), cache_(kCached) {}

    // All pairs of a leaf below a node.
    void below(size_t node) {
        others_.assign(1, 1);
        size_t first = 0;
        int depth = 0;
        while (node >> depth > 1) ++depth;
        while (depth-- > 0) {
            size_t last = others_.size();
            hand_down(node >> depth, first, last);
            first = last;
        }
        visit(node, first);
    }

  private:
    struct Leaf {
        size_t number = size_t(-1);
        LeafBoxes boxes;
        Facet facets[kLeaf];
    };
    static constexpr size_t kCached = 256;

    void visit(size_t node, size_t first) {
        size_t last = others_.size();
        if (node >= tree_.leaves) {
            Leaf mine = leaf(node - tree_.leaves);  // the cache may lose it to another
            for (size_t i = first; i < last; ++i) mark_leaves(node, mine, others_[i]);
            return;
        }
        for (size_t child : {2 * node, 2 * node + 1}) {
            hand_down(child, first, last);
            if (others_.size() > last) visit(child, last);
            others_.resize(last);
        }
    }

    // Adds to the end of the list the children of the nodes in [first, last) that meet the child.
    void hand_down(size_t child, size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) {
            for (size_t other : {2 * others_[i], 2 * others_[i] + 1}) {
                if (other >= child && pairs_.meet(child, other)) others_.push_back(other);
            }
        }
    }

    // Neighbours in space follow each other: they are kept a while.
    const Leaf& leaf(size_t number) {
        Leaf& leaf = cache_[number % kCached];
        if (leaf.number == number) return leaf;
        leaf.number = number;
        for (size_t lane = 0; lane < kLeaf; ++lane) leaf.boxes.clear(lane);
        for (size_t i = tree_.first(number); i < tree_.last(number); ++i) {
            size_t t = size_t(tree_.order[i]), lane = i % kLeaf;
            if (pairs_.aspects_[t].turn == 0) continue;
            leaf.boxes.set(lane, mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2));
            leaf.facets[lane] = {{mesh_[t][0], mesh_[t][1], mesh_[t][2]}, pairs_.aspects_[t]};
        }
        return leaf;
    }

    void mark_leaves(size_t node, const Leaf& mine, size_t other) {
        const Leaf& theirs = leaf(other - tree_.leaves);
        unsigned near = theirs.boxes.meeting(box_of(tree_.low + 3 * node, tree_.high + 3 * node));
        for (; near; near &= near - 1) {
            size_t j = size_t(std::countr_zero(near));
            unsigned met = mine.boxes.meeting(theirs.boxes[j]);
            if (node == other) met &= (1u << j) - 1;
            for (; met; met &= met - 1) mark_pair(mine, size_t(std::countr_zero(met)), theirs, j);
        }
    }

    void mark_pair(const Leaf& one, size_t i, const Leaf& other, size_t j) {
        size_t s = size_t(tree_.order[tree_.first(one.number) + i]);
        size_t t = size_t(tree_.order[tree_.first(other.number) + j]);
        if (!pairs_.asked(s, t) || (pairs_.marked(s) && pairs_.marked(t)) || !overlap(mesh_, one.facets[i], other.facets[j])) return;
        pairs_.mark(s);
        pairs_.mark(t);
    }

    Pairs& pairs_;
    const MeshView& mesh_;
    const TreeView& tree_;
    std::vector<Leaf> cache_;
    std::vector<size_t> others_;
};

Array<bool> Pairs::run() {
    size_t first = 1;
    for (size_t below = tree_.leaves; below > kTask; below /= 2) first *= 2;
    tbb::enumerable_thread_specific<Search> searches([&] { return Search(*this); });
    tbb::parallel_for(first, 2 * first, [&](size_t node) { searches.local().below(node); });
    Array<bool> marks(mesh_.count, 1);
    std::copy(marks_.begin(), marks_.end(), marks.data.get());
    return marks;
}

}  // namespace

Array<bool> self_intersecting_triangles(const MeshView& mesh, const TreeView& tree, const bool* among) {
    return Pairs(mesh, tree, among).run();
}

}  // namespace fracslice::mesh
