// Marching cubes' case table, made at start: on a face with two inside corners across from each other, each stands by
// itself, in both cells alike, so that the triangles of all cells close (Lorensen and Cline 1987; the rule of
// Montani, Scateni and Scopigno 1994).
//
// Corner c = x | y << 1 | z << 2. Edge = axis * 4 + the lower corner's bits on the other two axes, the lower axis first.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace peers {

struct Cases {
    // The edges of each case's triangles, three a triangle, counter-clockwise seen from outside.
    std::array<std::vector<std::uint8_t>, 256> edges;

    Cases() {
        for (int mask = 0; mask < 256; ++mask) make(mask);
    }

private:
    static int edge(int a, int b) {
        const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2, low = a & b;
        const int first = axis == 0 ? low >> 1 & 1 : low & 1, second = axis == 2 ? low >> 1 & 1 : low >> 2 & 1;
        return axis * 4 + (first | second << 1);
    }

    // The two faces that an edge lies in, as bits 2 * axis + side.
    static int faces(int edge) {
        const int axis = edge >> 2, first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
        return 1 << (2 * first + (edge & 1)) | 1 << (2 * second + (edge >> 1 & 1));
    }

    // From the edge where the outline on a face leaves the inside to the one where it enters.
    static std::array<int, 12> outline(int mask) {
        std::array<int, 12> next;
        next.fill(-1);
        for (int face = 0; face < 6; ++face) {
            const int axis = face >> 1, high = face & 1, origin = high ? 1 << axis : 0;
            const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
            std::array<int, 4> around = {origin, origin | u, origin | u | v, origin | v};
            if (!high) std::swap(around[1], around[3]);
            const auto inside = [&](int i) { return mask >> around[i % 4] & 1; };
            for (int i = 0; i < 4; ++i) {
                if (inside(i) || !inside(i + 1)) continue;
                int last = i + 1;
                while (inside(last + 1)) ++last;
                next[edge(around[last % 4], around[(last + 1) % 4])] = edge(around[i], around[(i + 1) % 4]);
            }
        }
        return next;
    }

    void make(int mask) {
        const std::array<int, 12> next = outline(mask);
        std::array<bool, 12> seen{};
        for (int start = 0; start < 12; ++start) {
            if (next[start] < 0 || seen[start]) continue;
            std::vector<int> loop;
            for (int e = start; !seen[e]; e = next[e]) {
                seen[e] = true;
                loop.push_back(e);
            }
            std::vector<std::uint8_t> made;
            split(loop, 0, int(loop.size()) - 1, made);
            edges[mask].insert(edges[mask].end(), made.begin(), made.end());
        }
    }

    // Cuts loop[i..j] into triangles with the fewest diagonals in a face of the cube: the cell across might repeat one.
    static int split(const std::vector<int>& loop, int i, int j, std::vector<std::uint8_t>& out) {
        if (j - i < 2) return 0;
        const auto in_face = [&](int a, int b) {
            const bool diagonal = b - a > 1 && !(a == 0 && b == int(loop.size()) - 1);
            return diagonal && (faces(loop[a]) & faces(loop[b])) ? 1 : 0;
        };
        int best = 99;
        std::vector<std::uint8_t> chosen;
        for (int k = i + 1; k < j; ++k) {
            std::vector<std::uint8_t> made = {std::uint8_t(loop[i]), std::uint8_t(loop[j]), std::uint8_t(loop[k])};
            int bad = in_face(i, k) + in_face(k, j);
            bad += split(loop, i, k, made);
            bad += split(loop, k, j, made);
            if (bad < best) {
                best = bad;
                chosen = made;
            }
        }
        out.insert(out.end(), chosen.begin(), chosen.end());
        return best;
    }
};

}  // namespace peers
