// The tiles of a layer as a picture meets them.
#pragma once
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "picture.h"

namespace fracslice::slices {

// Eight rows of pixels after eight rows, sorted by counting: first by columns, then by rows.
class TileRows {
 public:
    struct Spot {
        int32_t across, tile;
    };

    TileRows(const Slab& slab, const View& view, int down, int across) {
        const auto first = kTiles, last = int32_t(slab.tiles().count());
        spots_.resize(size_t(last - first));
        Rows<int32_t> by_column(spots_.size());
        auto row = [&](int32_t t) { return down - (view.transposed ? slab.tiles().place[t].x : slab.tiles().place[t].y); };
        auto column = [&](int32_t t) {
            const int at = view.transposed ? slab.tiles().place[t].y : slab.tiles().place[t].x;
            return view.backwards ? across - at : at - 1;
        };
        std::vector<int32_t> columns(across + 1), rows(down + 1);
        for (int32_t t = first; t < last; ++t) ++columns[column(t) + 1], ++rows[row(t) + 1];
        std::partial_sum(columns.begin(), columns.end(), columns.begin());
        std::partial_sum(rows.begin(), rows.end(), rows.begin());
        begin_ = rows;
        for (int32_t t = first; t < last; ++t) by_column[columns[column(t)]++] = t;
        for (int32_t t : by_column) spots_[rows[row(t)]++] = {column(t), t};
    }
    std::pair<const Spot*, const Spot*> operator[](int row) const {
        return {spots_.data() + begin_[row], spots_.data() + begin_[row + 1]};
    }

 private:
    Rows<Spot> spots_;
    std::vector<int32_t> begin_;  // of each row of tiles
};

}  // namespace fracslice::slices
