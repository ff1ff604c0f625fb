#include "stars.h"

namespace fracslice::mesh {
namespace {

constexpr size_t kParts = 512;  // that triangles, and vertices, are cut into at most
constexpr int kLeastShift = 12;

}  // namespace

Stars::Stars(const Triangles& triangles)
    : vertices_(triangles.vertices), shift_(kLeastShift), corners_(3 * triangles.count, 1) {
    while ((vertices_ >> shift_) >= kParts) ++shift_;
    size_t blocks = vertices_ ? ((vertices_ - 1) >> shift_) + 1 : 0;
    size_t size = std::max((triangles.count + kParts - 1) / kParts, size_t(1) << kLeastShift);
    size_t parts = (triangles.count + size - 1) / size;
    auto for_each_corner = [&](size_t part, const auto& act) {
        for (size_t c = 3 * part * size, last = 3 * std::min(triangles.count, (part + 1) * size); c < last; ++c) {
            act(size_t(triangles.corners[c]), c);
        }
    };
    std::vector<std::vector<size_t>> next(parts, std::vector<size_t>(blocks, 0));  // where each part puts a block's corners
    tbb::parallel_for(size_t(0), parts, [&](size_t part) {
        for_each_corner(part, [&](size_t v, size_t) { ++next[part][v >> shift_]; });
    });
    size_t total = 0;
    for (size_t block = 0; block < blocks; ++block) {
        starts_.push_back(total);
        for (size_t part = 0; part < parts; ++part) total += std::exchange(next[part][block], total);
    }
    starts_.push_back(total);
    assert(total == corners_.rows);
    tbb::parallel_for(size_t(0), parts, [&](size_t part) {
        for_each_corner(part, [&](size_t v, size_t c) {
            uint64_t within = v - (v >> shift_ << shift_);
            corners_.data[next[part][v >> shift_]++] = within << kCornerBits | c;
        });
    });
}

}  // namespace fracslice::mesh
