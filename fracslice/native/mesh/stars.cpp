#include "stars.h"

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

}  // namespace fracslice::mesh
