// Around vertex v each triangle is an arrow from its next corner to the one before. On a closed, oriented surface every
// neighbour of v then has one arrow in and one out, and all arrows form one ring.
#include "edge_topology.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <numeric>
#include <vector>

namespace fracslice::mesh {
namespace {

// Joins two sets of a forest of lowest indices, halving paths (Tarjan and van Leeuwen 1984); whether they were apart.
bool unite(std::vector<int32_t>& parent, int32_t a, int32_t b) {
    while (parent[a] != a) a = parent[a] = parent[parent[a]];
    while (parent[b] != b) b = parent[b] = parent[parent[b]];
    if (a == b) return false;
    parent[std::max(a, b)] = std::min(a, b);
    return true;
}

// Counts at one vertex after the other.
class Fans {
  public:
    explicit Fans(const Triangles& triangles) : triangles_(triangles) {}

    void add(const int64_t* corners, size_t degree) {
        if (ring(corners, degree)) {
            counts.edges += int64_t(degree);
            return;
        }
        set_spokes(corners, degree);
        int64_t fans = int64_t(degree);
        for (size_t i = 0, j; i < spokes_.size(); i = j) {  // one neighbour after the other
            size_t outward = 0;
            for (j = i; j < spokes_.size() && spokes_[j] >> 32 == spokes_[i] >> 32; ++j) {
                outward += !(spokes_[j] & 1);
                fans -= j > i && unite(fan_, corner(spokes_[i]), corner(spokes_[j]));
            }
            ++counts.edges;
            counts.open += j - i == 1;
            counts.crowded += j - i > 2;
            counts.misoriented += j - i > 1 && 2 * outward != j - i;
        }
        counts.extra_fans += fans - 1;
    }

    Links counts;

  private:
    // Whether all arrows form one ring, as nearly everywhere: then nothing needs to be sorted.
    bool ring(const int64_t* corners, size_t degree) {
        arrows_.resize(degree);
        for (size_t i = 0; i < degree; ++i) {
            const int32_t* t = triangles_[size_t(corners[i] / 3)];
            int k = int(corners[i] % 3);
            arrows_[i] = {t[(k + 1) % 3], t[(k + 2) % 3]};
        }
        int32_t first = arrows_[0].from, at = arrows_[0].to;
        size_t length = 1;
        for (; at != first && length < degree; ++length) {
            size_t next = 1;
            while (next < degree && arrows_[next].from != at) ++next;
            if (next == degree) return false;
            at = arrows_[next].to;
        }
        return at == first && length == degree;
    }

    // The two edges of each corner that meet at the vertex, by neighbour: neighbour, corner, whether inward, as one number.
    void set_spokes(const int64_t* corners, size_t degree) {
        spokes_.resize(2 * degree);
        fan_.resize(degree);
        for (size_t i = 0; i < degree; ++i) {
            const int32_t* t = triangles_[size_t(corners[i] / 3)];
            int k = int(corners[i] % 3);
            spokes_[2 * i] = uint64_t(t[(k + 1) % 3]) << 32 | 2 * i;
            spokes_[2 * i + 1] = uint64_t(t[(k + 2) % 3]) << 32 | 2 * i | 1;
            fan_[i] = int32_t(i);
        }
        std::sort(spokes_.begin(), spokes_.end());
    }

    static int32_t corner(uint64_t spoke) { return int32_t(uint32_t(spoke) >> 1); }

    struct Arrow {
        int32_t from, to;
    };

    const Triangles& triangles_;
    std::vector<Arrow> arrows_;
    std::vector<uint64_t> spokes_;
    std::vector<int32_t> fan_;
};

Links operator+(const Links& a, const Links& b) {
    return {a.edges + b.edges, a.open + b.open, a.crowded + b.crowded, a.misoriented + b.misoriented,
            a.extra_fans + b.extra_fans};
}

}  // namespace

CornersByVertex corners_by_vertex(const Triangles& triangles) {
    size_t corners = 3 * triangles.count;
    CornersByVertex found{{triangles.vertices + 1, 1}, {corners, 1}};
    int64_t* start = found.start.data.get();
    std::fill(start, start + triangles.vertices + 1, 0);
    // Where each vertex ends, then filled backwards to where it starts.
    for (size_t c = 0; c < corners; ++c) ++start[triangles.corners[c]];
    std::partial_sum(start, start + triangles.vertices + 1, start);
    for (size_t c = corners; c-- > 0;) found.corner.data[--start[triangles.corners[c]]] = int64_t(c);
    return found;
}

Links links(const Triangles& triangles, const bool* counted) {
    CornersByVertex corners = corners_by_vertex(triangles);
    const int64_t* start = corners.start.data.get();
    return tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, triangles.vertices, 4096), Links(),
        [&](const tbb::blocked_range<size_t>& range, const Links& before) {
            Fans fans(triangles);
            for (size_t v = range.begin(); v < range.end(); ++v) {
                size_t degree = size_t(start[v + 1] - start[v]);
                if (degree && counted[v]) fans.add(corners.corner.data.get() + start[v], degree);
            }
            return before + fans.counts;
        },
        [](const Links& a, const Links& b) { return a + b; });
}

Parts parts(const Triangles& triangles) {
    std::vector<int32_t> parent(triangles.vertices);
    std::iota(parent.begin(), parent.end(), 0);
    for (size_t t = 0; t < triangles.count; ++t) {
        unite(parent, triangles[t][0], triangles[t][1]);
        unite(parent, triangles[t][0], triangles[t][2]);
    }
    // Parents are lower than their children, so that one pass leaves roots alone.
    for (int32_t& p : parent) p = parent[p];
    Parts found{{triangles.count, 1}};
    std::vector<int32_t> number(triangles.vertices, -1);
    for (size_t t = 0; t < triangles.count; ++t) {
        int32_t& part = number[parent[triangles[t][0]]];
        if (part < 0) part = found.count++;
        found.labels.data[t] = part;
    }
    return found;
}

Array<double> shell_volumes(const MeshView& mesh, const int32_t* labels, size_t parts) {
    Array<double> volumes(parts, 1);
    std::fill_n(volumes.data.get(), parts, 0.0);
    std::vector<const double*> origin(parts, nullptr);
    for (size_t t = 0; t < mesh.count; ++t) {
        const double*& o = origin[labels[t]];
        if (!o) o = mesh.corner(t, 0);
        const double *a = mesh.corner(t, 0), *b = mesh.corner(t, 1), *c = mesh.corner(t, 2);
        double ax = a[0] - o[0], ay = a[1] - o[1], az = a[2] - o[2];
        double bx = b[0] - o[0], by = b[1] - o[1], bz = b[2] - o[2];
        double cx = c[0] - o[0], cy = c[1] - o[1], cz = c[2] - o[2];
        volumes.data[labels[t]] += (ay * bz - az * by) * cx + (az * bx - ax * bz) * cy + (ax * by - ay * bx) * cz;
    }
    for (size_t part = 0; part < parts; ++part) volumes.data[part] /= 6;
    return volumes;
}

}  // namespace fracslice::mesh
