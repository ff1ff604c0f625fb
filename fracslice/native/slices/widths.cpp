#include "layer_runs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fracslice::slices {
namespace {

// Nearest pixels of a row to the columns of another, of which each column has one at a height above or below it: the part of the
// Voronoi diagram that the row cuts (Maurer, Qi and Raghavan 2003, "A linear time algorithm for computing exact Euclidean distance
// transforms of binary images in arbitrary dimensions").
class VoronoiRow {
  public:
    explicit VoronoiRow(double width) : width_(width) {}

    void clear() { sites_.clear(); }

    // A site in a column farther to the right.
    void add(int column, double square) {
        while (sites_.size() > 1 && is_hidden(sites_[sites_.size() - 2], sites_.back(), {column, square})) sites_.pop_back();
        sites_.push_back({column, square});
    }

    // Least squared distance of each column to a site.
    void squares(int columns, double* to) const {
        size_t k = 0;
        for (int x = 0; x < columns; ++x) {
            double least = square(sites_[k], x);
            for (double next; k + 1 < sites_.size() && (next = square(sites_[k + 1], x)) < least; ++k) least = next;
            to[x] = least;
        }
    }

  private:
    struct Site {
        int column;
        double square;  // squared distance to the row
    };

    // Whether the site between two others is nowhere in the row the nearest.
    bool is_hidden(const Site& left, const Site& between, const Site& right) const {
        const double a = double(between.column - left.column) * width_, b = double(right.column - between.column) * width_, c = a + b;
        return c * between.square - b * left.square - a * right.square - a * b * c > 0;
    }
    double square(const Site& site, int x) const {
        const double across = double(site.column - x) * width_;
        return site.square + across * across;
    }

    double width_;
    std::vector<Site> sites_;
};

// Of each pixel the row of the nearest one in its column that is not of the region, the upper of two; -1 if there is none.
Image<int32_t> nearest_rows(const ImageView<bool>& region) {
    Image<int32_t> rows(region.height, region.width, -1);
    for (int y = 0; y < region.height; ++y) {
        for (int x = 0; x < region.width; ++x) rows[y][x] = !region[y][x] ? y : y ? rows[y - 1][x] : -1;
    }
    for (int y = region.height - 2; y >= 0; --y) {
        for (int x = 0; x < region.width; ++x) {
            const int32_t before = rows[y][x], behind = rows[y + 1][x];
            if (behind > y && (before < 0 || behind - y < y - before)) rows[y][x] = behind;
        }
    }
    return rows;
}

}  // namespace

Image<int32_t> count_pixels(const Runs& runs, int times) {
    Image<int32_t> count((runs.height() + times - 1) / times, (runs.width + times - 1) / times);
    for (int y = 0; y < runs.height(); ++y) {
        int32_t* line = count[y / times];
        for (int32_t r = runs.rows[y]; r < runs.rows[y + 1]; ++r) {
            const int first = runs.begin[r] / times, last = (runs.end[r] - 1) / times;
            for (int x = first; x <= last; ++x) line[x] += times;
            line[first] -= runs.begin[r] - first * times;
            line[last] -= (last + 1) * times - runs.end[r];
        }
    }
    return count;
}

Image<uint8_t> narrow_pixels(const Runs& runs, bool gaps, int times, const std::array<int64_t, 2>& longest) {
    const int width = runs.width;
    Image<uint8_t> narrow((runs.height() + times - 1) / times, (width + times - 1) / times);
    std::vector<int64_t> since(size_t(width), -longest[1] - 1);  // row of the last change in each column
    for (int y = 0; y < runs.height(); ++y) {
        const int32_t first = runs.rows[y], last = runs.rows[y + 1];
        for (int32_t r = first; r < last - gaps; ++r) {
            const int low = gaps ? runs.end[r] : runs.begin[r], high = gaps ? runs.begin[r + 1] : runs.end[r];
            if (high - low > longest[0]) continue;
            std::fill(narrow[y / times] + low / times, narrow[y / times] + (high - 1) / times + 1, uint8_t(1));
        }
        // Columns that change between the row below and this one, by the ends of the runs of both.
        int32_t a = y ? runs.rows[y - 1] : first, b = first;
        bool at_a = false, at_b = false, changed = false;
        for (int x = 0;;) {
            const int to_a = a == first || y == 0 ? width : at_a ? runs.end[a] : runs.begin[a];
            const int to_b = b == last ? width : at_b ? runs.end[b] : runs.begin[b];
            const int to = std::min(to_a, to_b);
            for (int column = x; changed && column < to; ++column) {
                if (at_b == gaps && y - since[size_t(column)] <= longest[1]) {
                    for (int64_t v = since[size_t(column)] / times; v <= (y - 1) / times; ++v) narrow[int(v)][column / times] = 1;
                }
                since[size_t(column)] = y;
            }
            if (to == width) break;
            if (to_a == to) a += at_a, at_a = !at_a;
            if (to_b == to) b += at_b, at_b = !at_b;
            x = to, changed = at_a != at_b;
        }
    }
    return narrow;
}

Image<uint8_t> painted(const Runs& runs, int top, int left, int height, int width) {
    Image<uint8_t> image(height, width);
    for (int y = std::max(-top, 0); y < std::min(height, runs.height() - top); ++y) {
        for (int32_t r = runs.rows[top + y]; r < runs.rows[top + y + 1]; ++r) {
            const int begin = std::max(runs.begin[r] - left, 0), end = std::min(runs.end[r] - left, width);
            if (begin < end) std::fill(image[y] + begin, image[y] + end, uint8_t(1));
        }
    }
    return image;
}

Image<double> distances(const ImageView<bool>& region, double height, double width) {
    const Image<int32_t> rows = nearest_rows(region);
    Image<double> result(region.height, region.width, std::numeric_limits<double>::infinity());
    VoronoiRow sites(width);
    for (int y = 0; y < region.height; ++y) {
        sites.clear();
        bool some = false;
        for (int x = 0; x < region.width; ++x) {
            if (rows[y][x] < 0) continue;
            const double up = double(rows[y][x] - y) * height;
            sites.add(x, up * up);
            some = true;
        }
        if (!some) continue;
        sites.squares(region.width, result[y]);
        for (int x = 0; x < region.width; ++x) result[y][x] = std::sqrt(result[y][x]);
    }
    return result;
}

Image<uint8_t> dilated(const ImageView<uint8_t>& image, const ImageView<double>& cone) {
    Image<uint8_t> out(image.height, image.width);
    std::copy_n(image.pixels, out.pixels.size(), out.pixels.begin());
    const int reach = cone.height / 2;
    auto is_deep = [&](int y, int x) {  // full pixels all around: those beside it reach as far
        if (y == 0 || x == 0 || y == image.height - 1 || x == image.width - 1) return false;
        for (int v = y - 1; v <= y + 1; ++v) {
            if (std::any_of(image[v] + x - 1, image[v] + x + 2, [](uint8_t a) { return a != 255; })) return false;
        }
        return true;
    };
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            if (image[y][x] == 0 || is_deep(y, x)) continue;
            for (int v = std::max(y - reach, 0); v < std::min(y + reach + 1, image.height); ++v) {
                for (int u = std::max(x - reach, 0); u < std::min(x + reach + 1, image.width); ++u) {
                    const double grown = std::min(image[y][x] + cone[v - y + reach][u - x + reach], 255.0);
                    if (grown > out[v][u]) out[v][u] = uint8_t(grown + 0.5);
                }
            }
        }
    }
    return out;
}

}  // namespace fracslice::slices
