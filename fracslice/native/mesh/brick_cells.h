// A brick with what the cells in it look at.
#pragma once
#include "cells.h"
#include "feature.h"

namespace fracslice::mesh {

// Where Numbers holds the crossing on each edge of the cell at 0, 0, 0.
constexpr std::array<uint16_t, 12> make_places() {
    std::array<uint16_t, 12> places{};
    for (int e = 0; e < 12; ++e) places[e] = uint16_t(number_at(kEdges[e].axis, kEdges[e].dx, kEdges[e].dy, kEdges[e].dz));
    return places;
}
constexpr std::array<uint16_t, 12> kPlaces = make_places();

// A cell: its lower corner relative to its brick, and in grid units; its case; where Numbers holds its crossings.
struct Cell {
    int x, y, z;
    Vec3 lower;
    uint8_t number;
    const uint32_t* numbers;

    uint32_t at(int e) const { return numbers[kPlaces[e]]; }
    BitPlane bit() const { return BitPlane(1) << (y * 8 + z); }
};

// A brick's cells; its crossings are still to be numbered.
struct BrickCells {
    Octant octant;
    std::array<CornerPlanes, kSide + 1> corners;
    Numbers numbers;
    std::array<int, 3> first;  // its lowest grid point

    BrickCells(const CellGrid& cells, size_t i)
        : octant(cells.octant(i)), corners(corners_of(octant, cells.signs())), first(cells.place(i)) {
        for (int& k : first) k *= kSide;
    }

    // Calls visit(cell) for the cells that the surface passes.
    template <class Visit>
    void for_each(const Visit& visit) const {
        for_each_cell(corners, [&](int x, int y, int z, uint8_t number) { visit(cell(x, y, z, number)); });
    }

    // The same for some of plane x.
    template <class Visit>
    void for_each(int x, BitPlane cells, const Visit& visit) const {
        for_each_cell(corners[x], corners[x + 1], x, cells,
                      [&](int, int y, int z, uint8_t number) { visit(cell(x, y, z, number)); });
    }

  private:
    Cell cell(int x, int y, int z, uint8_t number) const {
        Vec3 lower = {double(first[0] + x), double(first[1] + y), double(first[2] + z)};
        return {x, y, z, lower, number, &numbers[number_at(0, x, y, z)]};
    }
};

}  // namespace fracslice::mesh
