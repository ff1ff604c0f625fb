#include "forest.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>

namespace fracslice::printing {
namespace {

double across(const Point& a, const Point& b) {
    const double x = a[0] - b[0], y = a[1] - b[1];
    return std::sqrt(x * x + y * y);
}

double distance(const Point& a, const Point& b) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return std::sqrt(x * x + y * y + z * z);
}

bool is_steep(const Point& start, const Point& end) { return across(start, end) <= (start[2] - end[2]) * 1.001; }

// A place where a branch may end: on a trunk, or at another branch's node.
struct Meeting {
    double saved;  // length of pillars, mm
    bool is_trunk;
    int64_t number;
    Point point;

    bool operator<(const Meeting& other) const {
        return std::tuple(-saved, is_trunk, number) < std::tuple(-other.saved, other.is_trunk, other.number);
    }
};

class Growth {
  public:
    Growth(const Room& room, const Manners& manners) : room_(room), manners_(manners) {}

    Grown grown(const std::vector<Point>& ends) {
        for (const Point& end : ends) open(add(end));
        while (!heap_.empty()) {
            const int64_t node = heap_.top().second;
            heap_.pop();
            if (is_open(node)) {
                close(node);
                lead(node);
            }
        }
        return std::move(made_);
    }

  private:
    int64_t add(const Point& point) {
        made_.places.push_back(point);
        made_.down.push_back(-1);
        made_.on.push_back(-1);
        slot_.push_back(-1);
        return int64_t(made_.places.size()) - 1;
    }

    // Nodes that are not led on yet are those of `open_`, in no order.
    bool is_open(int64_t node) const { return slot_[size_t(node)] >= 0; }
    void open(int64_t node) {
        slot_[size_t(node)] = int64_t(open_.size());
        open_.push_back(node);
        heap_.emplace(made_.places[size_t(node)][2], node);
    }
    void close(int64_t node) {
        const int64_t slot = std::exchange(slot_[size_t(node)], -1), last = open_.back();
        open_.pop_back();
        if (last == node) return;
        open_[size_t(slot)] = last;
        slot_[size_t(last)] = slot;
    }

    void lead(int64_t node) {
        const Point point = made_.places[size_t(node)];
        for (const Meeting& meeting : meetings(point)) {
            if (!room_.is_free(point, meeting.point, manners_.wide)) continue;
            if (meeting.is_trunk) {
                const int64_t end = made_.down[size_t(node)] = add(meeting.point);
                made_.on[size_t(end)] = meeting.number;
                return;
            }
            if (!room_.is_free(made_.places[size_t(meeting.number)], meeting.point, manners_.wide)) continue;
            close(meeting.number);
            const int64_t both = add(meeting.point);
            made_.down[size_t(node)] = made_.down[size_t(meeting.number)] = both;
            open(both);
            return;
        }
        const Point corner = room_.corner(point, manners_.wide, manners_.narrow);
        if (corner[2] > room_.floor || across(corner, point) > 0) {
            const int64_t next = made_.down[size_t(node)] = add(corner);
            open(next);
        } else {
            made_.trunks.push_back(node);
        }
    }

    // What a node may be led to, first what saves most.
    std::vector<Meeting> meetings(const Point& point) const {
        std::vector<Meeting> found;
        const double own = room_.cost[room_.at(point)] + manners_.foot;
        for (const int64_t node : open_) {
            const Point& other = made_.places[size_t(node)];
            if (is_near(point, other)) with_branch(point, own, node, other, found);
        }
        for (size_t trunk = 0; trunk < made_.trunks.size(); ++trunk) {
            const Point& top = made_.places[size_t(made_.trunks[trunk])];
            if (is_near(point, top)) with_trunk(point, own, int64_t(trunk), top, found);
        }
        const size_t count = std::min(manners_.tries, found.size());
        std::partial_sort(found.begin(), found.begin() + ptrdiff_t(count), found.end());
        found.resize(count);
        return found;
    }

    bool is_near(const Point& a, const Point& b) const {
        return std::max(std::abs(a[0] - b[0]), std::abs(a[1] - b[1])) < manners_.farthest;
    }

    // The highest place within 45 degrees below a node and another.
    void with_branch(const Point& point, double own, int64_t node, const Point& other, std::vector<Meeting>& found) const {
        const double away = across(other, point);
        const double low = std::min((point[2] + other[2] - away) / 2, other[2]);
        if (low < room_.floor + manners_.lowest) return;
        const double share = away > 0 ? std::min((point[2] - low) / away, 1.0) : 1.0;
        const Point meeting{point[0] + share * (other[0] - point[0]), point[1] + share * (other[1] - point[1]), low};
        const double mine = distance(meeting, point), theirs = distance(meeting, other);
        if (std::max(mine, theirs) > manners_.farthest) return;
        const double saved = own + room_.cost[room_.at(other)] - mine - theirs - room_.cost[room_.at(meeting)];
        if (saved > 0) found.push_back({saved, false, node, meeting});
    }

    // The highest place of a trunk within 45 degrees below a node.
    void with_trunk(const Point& point, double own, int64_t trunk, const Point& top, std::vector<Meeting>& found) const {
        const Point meeting{top[0], top[1], std::min(point[2] - across(top, point), top[2])};
        const double mine = distance(meeting, point);
        if (mine > manners_.farthest || meeting[2] < room_.floor + manners_.lowest) return;
        if (own - mine > 0) found.push_back({own - mine, true, trunk, meeting});
    }

    struct Lower {
        bool operator()(const std::pair<double, int64_t>& a, const std::pair<double, int64_t>& b) const {
            return a.first != b.first ? a.first < b.first : a.second > b.second;
        }
    };

    const Room& room_;
    const Manners& manners_;
    Grown made_;
    std::vector<int64_t> open_, slot_;
    std::priority_queue<std::pair<double, int64_t>, std::vector<std::pair<double, int64_t>>, Lower> heap_;
};

}  // namespace

std::array<int64_t, 3> Room::cells(const Point& point) const {
    std::array<int64_t, 3> cells;
    for (size_t k = 0; k < 3; ++k) {
        const double number = std::floor((point[k] - origin[k]) / cell[k]);
        cells[k] = int64_t(std::clamp(number, 0.0, double(shape[2 - k] - 1)));
    }
    return cells;
}

size_t Room::at(const Point& point) const {
    const auto [x, y, z] = cells(point);
    return size_t((z * shape[1] + y) * shape[2] + x);
}

bool Room::is_free(const Point& start, const Point& end, int least) const {
    const int64_t steps = int64_t(2 * distance(start, end) / *std::min_element(cell.begin(), cell.end())) + 1;
    for (int64_t n = 0; n <= steps; ++n) {
        const double share = double(n) / double(steps);
        Point along;
        for (size_t k = 0; k < 3; ++k) along[k] = start[k] + share * (end[k] - start[k]);
        if (away[at(along)] < least) return false;
    }
    return true;
}

Point Room::corner(const Point& start, int wide, int narrow) const {
    auto [x, y, z] = cells(start);
    const auto [width, depth, height] = cell;
    const double aside = std::sqrt(width * width + height * height), along = std::sqrt(depth * depth + height * height);
    const std::tuple<int, int, double> ways[] = {{0, 0, height}, {0, -1, aside}, {0, 1, aside}, {-1, 0, along}, {1, 0, along}};
    std::vector<Point> way{start};
    while (z > 0) {
        --z;
        double least = std::numeric_limits<double>::infinity();
        int64_t to_x = x, to_y = y;
        for (const auto& [dy, dx, length] : ways) {
            const int64_t j = y + dy, i = x + dx;
            if (j < 0 || j >= shape[1] || i < 0 || i >= shape[2]) continue;
            const double total = length + cost[(z * shape[1] + j) * shape[2] + i];
            if (total < least) std::tie(least, to_y, to_x) = std::tuple(total, j, i);
        }
        Point next = way.back();  // straight down, the way keeps its place
        if (to_x != x || to_y != y) {
            next[0] = origin[0] + (double(to_x) + 0.5) * width;
            next[1] = origin[1] + (double(to_y) + 0.5) * depth;
        }
        next[2] = origin[2] + (double(z) + 0.5) * height;
        way.push_back(next);
        x = to_x;
        y = to_y;
    }
    way.back()[2] = floor;
    return straight(way, away[at(start)] >= wide ? wide : narrow);
}

// The last point up to which a way may be straight, of those that halving comes to.
Point Room::straight(const std::vector<Point>& way, int least) const {
    size_t step = way.size() - 1;
    while (step > 1 && !(is_steep(way[0], way[step]) && is_free(way[0], way[step], least))) step /= 2;
    return way[step];
}

Grown grow_forest(const Room& room, const Manners& manners, const std::vector<Point>& ends) {
    return Growth(room, manners).grown(ends);
}

}  // namespace fracslice::printing
