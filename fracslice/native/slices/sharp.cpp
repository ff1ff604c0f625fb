// Where the outlines of a layer are, exactly: crossings settled on the field, and corners within pixels.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "evaluate.h"
#include "squares.h"

namespace fracslice {
namespace {

constexpr float kPrecise = 2e-3f;  // pixels that a last step may take a crossing
constexpr int kRounds = 16;
constexpr double kShort = 0.1;  // pixels: a shorter side tells no direction
constexpr double kSine = 0.17;  // of the angle between two sides, at least: 10 degrees
constexpr double kNear = 0.02;  // pixels between a corner and the zero set, at most
constexpr double kLeast = 1e-3;  // of a pixel's area that a corner changes; less is only beside one

struct Vector {
    double x, y;
};
Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y}; }
Vector operator*(double s, Vector a) { return {s * a.x, s * a.y}; }
Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y}; }
double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y; }
double det(Vector a, Vector b) { return a.x * b.y - a.y * b.x; }
Vector unit(Vector a) { return 1 / std::sqrt(dot(a, a)) * a; }
bool is_short(Vector a) { return dot(a, a) < kShort * kShort; }

// The crossings of a layer in order: their places, and those before them.
struct Outline {
    std::vector<Crossing> edges;
    std::vector<Vector> places;
    std::vector<int32_t> before;

    Outline(const Slab& slab, int layer) : edges(crossings(slab, layer).edges), before(edges.size()) {
        for (size_t i = 0; i < edges.size(); ++i) {
            const Crossing& e = edges[i];
            const Place p{layer, e.row / kTile + 1, e.column / kTile + 1};
            int number = 64 * e.up + kTile * (e.row % kTile) + e.column % kTile;
            double share = slab.cross[slab.at(p.layer, p.y, p.x)][number] / kWhole;
            places.push_back({e.column + (e.up ? 0 : share), e.row + (e.up ? share : 0)});
            before[e.following] = int32_t(i);
        }
    }
    // The pixel that the outline goes through from crossing i.
    Place pixel(int32_t i) const {
        const Crossing &a = edges[i], &b = edges[edges[i].following];
        // Halfway between the middles of both edges, times four.
        return {0, (2 * (a.row + b.row) + a.up + b.up) / 4, (2 * (a.column + b.column) + 2 - a.up - b.up) / 4};
    }
    // The sides before crossing i and after the next one.
    std::array<Vector, 2> sides(int32_t i) const {
        int32_t j = edges[i].following, from = before[i], to = edges[j].following;
        if (is_short(places[i] - places[from])) from = before[from];
        if (is_short(places[to] - places[j])) to = edges[to].following;
        return {places[i] - places[from], places[to] - places[j]};
    }
};

// Where the sides before a crossing and after the next one meet.
struct Corner {
    int32_t edge;
    Vector tip;
    double gain;  // pixels that it adds to the inside
};

// How much of the triangle between a, b and the tip lies in the pixel of the tip, if that is beside the one of a and b.
double share_beyond(Vector a, Vector b, Vector tip, const Place& own, const Place& beside) {
    auto along = [&](Vector v) { return own.x == beside.x ? v.y - std::max(own.y, beside.y) : v.x - std::max(own.x, beside.x); };
    double height = along(tip);
    return height == 0 ? 0 : height / (height - along(a)) * (height / (height - along(b)));
}

}  // namespace

// Crossings on the zero set: false position with the Illinois rule (Dowell and Jarratt 1971), all edges at once. Straight
// lines between the values at both ends would miss it by up to half a pixel where other faces are nearer, as just below a
// horizontal one.
void Slab::settle(int layer, const std::vector<Edge>& edges) {
    cross.resize(count());
    struct Root {
        float low, high, below, above, share;
        int moved;
        void step(float f) {
            bool lower = (f < 0) == (below < 0);
            if (lower && moved > 0) above /= 2;
            if (!lower && moved < 0) below /= 2;
            (lower ? low : high) = share, (lower ? below : above) = f, moved = lower ? 1 : -1;
            share = low + (high - low) * below / (below - above);
        }
    };
    std::vector<Root> roots;
    for (const Edge& e : edges) roots.push_back({0, 1, e.first, e.second, e.first / (e.first - e.second), 0});
    std::vector<int32_t> todo(edges.size());
    std::iota(todo.begin(), todo.end(), 0);
    std::vector<Spot> spots;
    for (int round = 0; round < kRounds && !todo.empty(); ++round) {
        spots.clear();
        for (int32_t i : todo) {
            const Edge& e = edges[i];
            int up = e.number >> 6;
            double share = roots[i].share;
            spots.push_back({kTile * (place[e.tile].x - 1) + (e.number & 7) + (up ? 0 : share),
                             kTile * (place[e.tile].y - 1) + (e.number >> 3 & 7) + (up ? share : 0)});
        }
        std::vector<float> f = values_at(layer, spots);
        size_t left = 0;
        for (size_t n = 0; n < todo.size(); ++n) {
            Root& root = roots[todo[n]];
            float before = root.share;
            if (f[n] == 0) continue;
            root.step(f[n]);
            if (std::fabs(root.share - before) > kPrecise) todo[left++] = todo[n];
        }
        todo.resize(left);
    }
    for (size_t i = 0; i < edges.size(); ++i) cross[edges[i].tile][edges[i].number] = share_of(roots[i].share);
}

// Corners within pixels: where the sides before and after meet, if the field changes its sign there. In the pixel that both
// crossings belong to, or in one beside it.
void Slab::sharpen(int layer) {
    const Outline outline(*this, layer);
    std::vector<Corner> corners;
    std::vector<Spot> spots;
    for (int32_t i = 0; i < int32_t(outline.edges.size()); ++i) {
        auto [before, after] = outline.sides(i);
        double turn = det(before, after);
        if (!(turn * turn > kSine * kSine * dot(before, before) * dot(after, after))) continue;
        Vector a = outline.places[i], b = outline.places[outline.edges[i].following];
        Vector tip = a + det(b - a, after) / turn * before, away = unit(before) - unit(after);
        Place own = outline.pixel(i);
        if (std::abs(int(std::floor(tip.y)) - own.y) + std::abs(int(std::floor(tip.x)) - own.x) > 1) continue;
        double gain = det(tip - a, b - a) / 2;
        if (std::fabs(gain) < kLeast) continue;
        corners.push_back({i, tip, gain});
        for (double side : {kNear, -kNear}) {
            Vector spot = tip + side * unit(away);
            spots.push_back({spot.x, spot.y});
        }
    }
    std::vector<float> f = values_at(layer, spots);
    size_t first = tips_.size();
    for (size_t n = 0; n < corners.size(); ++n) {
        if ((f[2 * n] < 0) == (f[2 * n + 1] < 0)) continue;
        auto [i, tip, gain] = corners[n];
        Vector a = outline.places[i], b = outline.places[outline.edges[i].following];
        Place own = outline.pixel(i), beside{0, int(std::floor(tip.y)), int(std::floor(tip.x))};
        double beyond = own.x == beside.x && own.y == beside.y ? 0 : share_beyond(a, b, tip, own, beside);
        put_tip(layer, own.y, own.x, float(gain * (1 - beyond)));
        if (beyond > 0) put_tip(layer, beside.y, beside.x, float(gain * beyond));
    }
    std::sort(tips_.begin() + std::ptrdiff_t(first), tips_.end(), [](const Tip& a, const Tip& b) { return a.cell < b.cell; });
}

void Slab::put_tip(int layer, int row, int column, float area) {
    if (row < 0 || column < 0 || row >= kTile * (ty_ - 2) || column >= kTile * (tx_ - 2)) return;
    int y = row / kTile + 1, x = column / kTile + 1, bit = kTile * (row % kTile) + column % kTile;
    int32_t t = at(layer, y, x);
    if (t < kTiles) t = add(layer, y, x), cross.resize(count());
    sharp[t] |= uint64_t(1) << bit;
    tips_.push_back({64 * int64_t(t) + bit, area});
}

float Slab::tip(int32_t tile, int bit) const {
    Tip cell{64 * int64_t(tile) + bit, 0};
    auto range = std::equal_range(tips_.begin(), tips_.end(), cell, [](const Tip& a, const Tip& b) { return a.cell < b.cell; });
    float area = 0;
    for (auto t = range.first; t != range.second; ++t) area += t->area;
    return area;
}

}  // namespace fracslice
