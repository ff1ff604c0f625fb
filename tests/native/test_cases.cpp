// The cases of marching cubes and what is derived from them.
#include <doctest/doctest.h>

#include <map>
#include <set>
#include <utility>

#include "mesh/cells.h"

namespace fracslice::mesh {
namespace {

using Segment = std::pair<int, int>;

int corner(int x, int y, int z) { return x + 2 * y + 4 * z; }

// Whether the ends of an edge of the cell have different signs.
bool crossed(int number, int e) {
    const Edge& edge = kEdges[e];
    const int low = corner(edge.dx, edge.dy, edge.dz);
    return (number >> low & 1) != (number >> (low | 1 << edge.axis) & 1);
}

// The directed edges of a case's triangles that have no opposite one: where the cell's surface ends.
std::set<Segment> border(int number) {
    std::map<Segment, int> count;
    const Case& type = kCases[number];
    for (int t = 0; t < type.triangles; ++t) {
        for (int k = 0; k < 3; ++k) ++count[{type.corners[3 * t + k], type.corners[3 * t + (k + 1) % 3]}];
    }
    std::set<Segment> border;
    for (auto [segment, n] : count) {
        CHECK(n == 1);
        if (!count.count({segment.second, segment.first})) border.insert(segment);
    }
    return border;
}

// The signs of a face's corners as those of the cell on its other side, where it is the opposite face.
int mirrored(int number, int axis) {
    int other = 0;
    for (int c = 0; c < 8; ++c) other |= (number >> (c ^ 1 << axis) & 1) << c;
    return other;
}

}  // namespace

TEST_CASE("triangles use the edges whose ends differ in sign, and no others") {
    for (int number = 0; number < 256; ++number) {
        std::set<int> used(kCases[number].corners, kCases[number].corners + 3 * kCases[number].triangles);
        for (int e = 0; e < 12; ++e) {
            CHECK(bool(used.count(e)) == crossed(number, e));
            CHECK(bool(kCases[number].edges >> e & 1) == crossed(number, e));
        }
    }
}

TEST_CASE("the triangles of a cell end in its faces, and those of the next cell go on there") {
    for (int number = 0; number < 256; ++number) {
        for (int axis = 0; axis < 3; ++axis) {
            // The cell beyond the upper face has this cell's upper corners for lower ones.
            const int next = mirrored(number, axis);
            std::set<Segment> here, there;
            for (auto [a, b] : border(number)) {
                const int face = common_face(a, b);
                CHECK(face >= 0);
                if (face == 2 * axis + 1) here.insert({a, b});
            }
            for (auto [a, b] : border(next)) {
                if (common_face(a, b) == 2 * axis) there.insert({b, a});
            }
            std::set<Segment> moved;  // from the upper to the lower face
            for (auto [a, b] : here) {
                auto lower = [&](int e) {
                    for (int f = 0; f < 12; ++f) {
                        Edge edge = kEdges[e], other = kEdges[f];
                        (axis == 0 ? edge.dx : axis == 1 ? edge.dy : edge.dz) = 0;
                        if (std::tie(edge.axis, edge.dx, edge.dy, edge.dz) == std::tie(other.axis, other.dx, other.dy, other.dz)) return f;
                    }
                    return -1;
                };
                moved.insert({lower(a), lower(b)});
            }
            CHECK(moved == there);
        }
    }
}

TEST_CASE("a loop is the border of its case, in the triangles' sense") {
    for (int number = 0; number < 256; ++number) {
        const Case& type = kCases[number];
        if (!type.loop_length) continue;
        std::set<Segment> loop;
        for (int k = 0; k < type.loop_length; ++k) {
            loop.insert({type.loop[k], type.loop[(k + 1) % type.loop_length]});
            CHECK(kFaces[number].after[k] == common_face(type.loop[k], type.loop[(k + 1) % type.loop_length]));
        }
        CHECK(loop == border(number));
        CHECK(type.triangles == type.loop_length - 2);
    }
}

TEST_CASE("flat cells are two triangles between four edges along one axis") {
    for (int axis = 0; axis < 3; ++axis) {
        for (int up = 0; up < 2; ++up) {
            const Case& type = kCases[kFlat[axis][up]];
            CHECK(type.triangles == 2);
            for (int k = 0; k < 6; ++k) CHECK(kEdges[type.corners[k]].axis == axis);
        }
    }
}

TEST_CASE("cases of a row are those of its corners, one by one") {
    CornerPlanes a, b;
    for (size_t k = 0; k < 4; ++k) a[k] = 0x9E3779B97F4A7C15u * (k + 1), b[k] = 0xC2B2AE3D27D4EB4Fu * (k + 5);
    for (int y = 0; y < 8; ++y) {
        const BitPlane row = cases_of_row(a, b, y);
        for (int z = 0; z < 8; ++z) {
            int expected = 0;
            for (int k = 0; k < 4; ++k) {
                expected |= int(a[size_t(k)] >> (8 * y + z) & 1) << 2 * k | int(b[size_t(k)] >> (8 * y + z) & 1) << (2 * k + 1);
            }
            CHECK(int(row >> 8 * z & 0xff) == expected);
        }
    }
}

}  // namespace fracslice::mesh
