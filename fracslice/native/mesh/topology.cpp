// Around vertex v each triangle is an arrow from its next corner to the one before. On a closed, oriented surface every
// neighbour of v then has one arrow in and one out, and all arrows form one ring.
#include "topology.h"

#include <algorithm>
#include <stdexcept>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "../disjoint_sets.h"

namespace fracslice::mesh {
namespace {

constexpr size_t kParts = 512;  // that triangles, and vertices, are cut into at most
constexpr int kLeastShift = 12;

struct Counts {
    size_t triangles = 0, corners = 0;
};

// Calls act(block, corners) for the blocks of a triangle's corners.
template <class Do>
void for_each_block_of(const int32_t* t, int shift, const Do& act) {
    const size_t a = size_t(t[0]) >> shift, b = size_t(t[1]) >> shift, c = size_t(t[2]) >> shift;
    if (a == b && b == c) return act(a, 3);
    act(a, 1 + (a == b) + (a == c));
    if (b != a) act(b, 1 + (b == c));
    if (c != a && c != b) act(c, 1);
}

}  // namespace

Stars::Stars(const Triangles& triangles) : triangles_(triangles), shift_(kLeastShift) {
    assert(triangles.count <= UINT32_MAX);
    while ((triangles.vertices >> shift_) >= kParts) ++shift_;
    const size_t blocks = triangles.vertices ? ((triangles.vertices - 1) >> shift_) + 1 : 0;
    const size_t size = std::max((triangles.count + kParts - 1) / kParts, size_t(1) << kLeastShift);
    const size_t parts = (triangles.count + size - 1) / size;
    auto for_each_triangle = [&](size_t part, const auto& act) {
        for (size_t t = part * size, last = std::min(triangles.count, (part + 1) * size); t < last; ++t) {
            for_each_block_of(triangles[t], shift_, [&](size_t block, size_t corners) { act(block, t, corners); });
        }
    };
    std::vector<std::vector<Counts>> next(parts, std::vector<Counts>(blocks));  // then where each part puts a block's triangles
    tbb::parallel_for(size_t(0), parts, [&](size_t part) {
        for_each_triangle(part, [&](size_t block, size_t, size_t corners) {
            ++next[part][block].triangles, next[part][block].corners += corners;
        });
    });
    Counts total;
    for (size_t block = 0; block < blocks; ++block) {
        starts_.push_back(total.triangles), corners_.push_back(total.corners);
        for (std::vector<Counts>& part : next) {
            total.corners += part[block].corners;
            total.triangles += std::exchange(part[block].triangles, total.triangles);
        }
    }
    starts_.push_back(total.triangles), corners_.push_back(total.corners);
    assert(total.corners == 3 * triangles.count);
    own_ = Array<uint32_t>(total.triangles, 1);
    tbb::parallel_for(size_t(0), parts, [&](size_t part) {
        for_each_triangle(part, [&](size_t block, size_t t, size_t) {
            own_.data[next[part][block].triangles++] = uint32_t(t);
        });
    });
}

namespace {

// Counts at one vertex after the other.
class Fans {
  public:
    explicit Fans(const Triangles& triangles) : triangles_(triangles) {}

    // Of the triangles around a vertex those with three different corners count.
    void add(int32_t v, std::span<const int64_t> corners) {
        arrows_.clear();
        for (int64_t corner : corners) {
            const int32_t* t = triangles_[size_t(corner / 3)];
            int32_t from = t[(corner + 1) % 3], to = t[(corner + 2) % 3];
            if (from != to && from != v && to != v) arrows_.push_back({from, to});
        }
        if (arrows_.empty()) return;
        if (ring()) {
            counts.edges += int64_t(arrows_.size());
            return;
        }
        set_spokes();
        int64_t fans = int64_t(arrows_.size());
        for (size_t i = 0, j; i < spokes_.size(); i = j) {  // one neighbour after the other
            size_t outward = 0;
            for (j = i; j < spokes_.size() && spokes_[j] >> 32 == spokes_[i] >> 32; ++j) {
                outward += !(spokes_[j] & 1);
                fans -= j > i && DisjointSets<int32_t>(fan_).unite(corner(spokes_[i]), corner(spokes_[j]));
            }
            ++counts.edges;
            counts.open += j - i == 1;
            counts.non_manifold += j - i > 2;
            counts.misoriented += j - i > 1 && 2 * outward != j - i;
        }
        counts.extra_fans += fans - 1;
    }

    EdgeCounts counts;

  private:
    // Whether all arrows form one ring, as nearly everywhere: then nothing needs to be sorted.
    bool ring() const {
        int32_t first = arrows_[0].from, at = arrows_[0].to;
        size_t length = 1, degree = arrows_.size();
        for (; at != first && length < degree; ++length) {
            size_t next = 1;
            while (next < degree && arrows_[next].from != at) ++next;
            if (next == degree) return false;
            at = arrows_[next].to;
        }
        return at == first && length == degree;
    }

    // The two edges of each corner that meet at the vertex, by neighbour: neighbour, corner, whether inward, as one number.
    void set_spokes() {
        spokes_.resize(2 * arrows_.size());
        fan_.resize(arrows_.size());
        for (size_t i = 0; i < arrows_.size(); ++i) {
            spokes_[2 * i] = uint64_t(arrows_[i].from) << 32 | 2 * i;
            spokes_[2 * i + 1] = uint64_t(arrows_[i].to) << 32 | 2 * i | 1;
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

EdgeCounts operator+(const EdgeCounts& a, const EdgeCounts& b) {
    return {a.edges + b.edges, a.open + b.open, a.non_manifold + b.non_manifold, a.misoriented + b.misoriented,
            a.extra_fans + b.extra_fans};
}

}  // namespace

CornersByVertex corners_by_vertex(const Triangles& triangles) {
    CornersByVertex result{{triangles.vertices + 1, 1}, {3 * triangles.count, 1}};
    int64_t *start = result.start.data.get(), *corner = result.corner.data.get();
    Stars stars(triangles);
    tbb::parallel_for(size_t(0), stars.blocks(), [&](size_t block) {
        size_t next = stars.corners_before(block);
        stars.for_each(block, [&](size_t v, std::span<const int64_t> corners) {
            start[v] = int64_t(next);
            std::copy(corners.begin(), corners.end(), corner + next);
            next += corners.size();
        });
    });
    start[triangles.vertices] = int64_t(3 * triangles.count);
    return result;
}

EdgeCounts edge_counts(const Triangles& triangles, const bool* counted) {
    Stars stars(triangles);
    return tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, stars.blocks(), 1), EdgeCounts(),
        [&](const tbb::blocked_range<size_t>& range, const EdgeCounts& before) {
            Fans fans(triangles);
            for (size_t block = range.begin(); block < range.end(); ++block) {
                stars.for_each(block, [&](size_t v, std::span<const int64_t> corners) {
                    if (counted[v]) fans.add(int32_t(v), corners);
                });
            }
            return before + fans.counts;
        },
        [](const EdgeCounts& a, const EdgeCounts& b) { return a + b; });
}

std::vector<int32_t> opposite_corners(const Triangles& triangles) {
    if (triangles.count > INT32_MAX / 3) throw std::invalid_argument("more than 2^31 corners");
    CornersByVertex by_vertex = corners_by_vertex(triangles);
    const int64_t *start = by_vertex.start.data.get(), *corner = by_vertex.corner.data.get();
    std::vector<int32_t> across(3 * triangles.count, -1);
    for (size_t v = 0; v < triangles.vertices; ++v) {
        for (int64_t i = start[v]; i < start[v + 1]; ++i) {
            int32_t c = int32_t(corner[i]), end = triangles.corners[after(c)];  // v -> end; its other triangle runs end -> v
            for (int64_t j = start[v]; j < start[v + 1]; ++j) {
                int32_t d = int32_t(corner[j]);
                if (triangles.corners[before(d)] != end) continue;
                across[size_t(before(c))] = after(d), across[size_t(after(d))] = before(c);
            }
        }
    }
    if (std::count(across.begin(), across.end(), -1)) throw std::invalid_argument("the surface is not closed");
    return across;
}

void Star::turn(int begin) {
    std::rotate(corner, corner + begin, corner + count);
    std::rotate(ring, ring + begin, ring + count);
}

CornerTable::CornerTable(const Triangles& triangles)
    : triangles_(triangles.corners, triangles.corners + 3 * triangles.count), across_(opposite_corners(triangles)),
      corner_(triangles.vertices, -1), last_(triangles.count, 0), gone_(triangles.count, 0) {
    for (size_t c = triangles_.size(); c-- > 0;) corner_[size_t(triangles_[c])] = int32_t(c);
}

bool CornerTable::star(size_t v, Star& result) const {
    int32_t begin = corner_[v], c = begin;
    result.count = 0;
    do {
        if (result.count == kDegree) return false;
        result.corner[result.count] = c;
        result.ring[result.count++] = at(after(c));
        c = after(across(after(c)));
    } while (c != begin);
    return true;
}

bool CornerTable::linked(const Star& star, int i) const {
    int32_t v = star.ring[i], begin = corner_[size_t(v)], c = begin;
    int k = star.count, degree = 0, common = 0;
    if (k == 3 && at(across(star.corner[(i + 1) % 3])) == v) return false;
    do {
        if (++degree + k - 4 > kDegree) return false;
        common += std::find(star.ring, star.ring + k, at(after(c))) != star.ring + k;
        c = after(across(after(c)));
    } while (c != begin);
    return common == 2;
}

void CornerTable::touch(int32_t c) {
    touched_.push_back(c);
    before_.push_back(last_[size_t(c / 3)]);
    last_[size_t(c / 3)] = int32_t(steps_.size());
}

void CornerTable::collapse(const Star& star) {
    int k = star.count;
    int32_t u = at(star.corner[0]), v = star.ring[0], first = star.corner[0], last = star.corner[k - 1];
    steps_.push_back({u, k, true, touched_.size()});
    for (int i = 0; i < k; ++i) {
        at(star.corner[i]) = v;
        touch(star.corner[i]);
    }
    touch(across(first)), touch(across(last));
    corner_[size_t(u)] = -1;
    corner_[size_t(v)] = star.corner[1];
    corner_[size_t(star.ring[1])] = after(star.corner[1]);
    corner_[size_t(star.ring[k - 1])] = before(star.corner[k - 2]);
    across(across(after(first))) = across(first), across(across(first)) = across(after(first));
    across(across(before(last))) = across(last), across(across(last)) = across(before(last));
    gone_[size_t(first / 3)] = gone_[size_t(last / 3)] = true;
}

int32_t CornerTable::changed_by(size_t t) const {
    int32_t step = last_[t];
    while (step) {
        const Step& s = steps_[size_t(step) - 1];
        auto result = std::find_if(touched(s), touched(s) + s.count, [&](int32_t c) { return size_t(c / 3) == t; });
        if (result < touched(s) + s.count) return step;
        result = std::find_if(result, result + 2, [&](int32_t c) { return size_t(c / 3) == t; });
        step = before_[size_t(result - touched_.begin())];
    }
    return 0;
}

int32_t CornerTable::above(int32_t step) const {
    for (;;) {
        const Step& s = steps_[size_t(step) - 1];
        auto first = touched(s), end = first + s.count + 2;
        auto later = std::find_if(first, end, [&](int32_t c) { return last_[size_t(c / 3)] != step; });
        if (later == end) return step;
        step = last_[size_t(*later / 3)];
    }
}

Star CornerTable::undo(int32_t step) {
    Step& s = steps_[size_t(step) - 1];
    Star star;
    star.count = s.count;
    std::copy_n(&touched_[s.begin], s.count, star.corner);
    int32_t first = star.corner[0], last = star.corner[s.count - 1];
    for (int i = 0; i < s.count; ++i) at(star.corner[i]) = s.vertex;
    for (int i = 0; i < s.count; ++i) star.ring[i] = at(after(star.corner[i]));
    across(across(before(last))) = before(last), across(across(last)) = last;
    across(across(after(first))) = after(first), across(across(first)) = first;
    gone_[size_t(first / 3)] = gone_[size_t(last / 3)] = false;
    corner_[size_t(s.vertex)] = first;
    corner_[size_t(star.ring[0])] = after(first);
    for (size_t i = s.begin + size_t(s.count) + 2; i-- > s.begin;) last_[size_t(touched_[i] / 3)] = before_[i];
    s.stands = false;
    return star;
}

}  // namespace fracslice::mesh
