#include "corner_table.h"

#include <algorithm>
#include <stdexcept>

#include "edge_topology.h"

namespace fracslice::mesh {

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
