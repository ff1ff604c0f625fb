// The outlines of a layer, exactly: crossings projected to the surface, corners and bends within pixels.
#include <algorithm>
#include <cmath>

#include "evaluate.h"
#include "marching_squares.h"

namespace fracslice::slices {
namespace {

constexpr float kPrecise = 2e-3f;  // pixels that a last step may take a crossing
constexpr double kTight = 1e-3;   // pixels within which a crossing is known
constexpr int kRounds = 24;
constexpr float kNearer = 32;  // times that a value is nearer to zero after a step that need not be looked at again
constexpr double kShort = 0.1;  // pixels: a shorter side tells no direction
constexpr double kSine = 0.17;  // of the angle between two sides, at least: 10 degrees
constexpr double kStraight = 0.005;  // of the angle beside an arc that is worth its while, at least
constexpr double kNear = 0.02;  // pixels between a corner and the zero set, at most
constexpr double kExact = 2e-3;  // that corners are known to
constexpr double kLeast = 1e-3;  // of a pixel's area that a corner or a bend changes; less is only beside a corner

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
// Curvature of the circle through three points, from the vectors between them.
double curvature(Vector u, Vector v) { return 2 * det(u, v) / std::sqrt(dot(u, u) * dot(v, v) * dot(u + v, u + v)); }

// The crossings of a layer in order: their places, and those before them.
struct Outline {
    std::vector<Crossing> edges;
    std::vector<Vector> places;
    std::vector<int32_t> before;

    explicit Outline(const Slab& slab) : edges(crossings(slab).edges), before(edges.size()) {
        for (size_t i = 0; i < edges.size(); ++i) {
            const Crossing& e = edges[i];
            const int y = e.row / kTile + 1, x = e.column / kTile + 1;
            int number = 64 * e.up + kTile * (e.row % kTile) + e.column % kTile;
            double share = slab.tiles().cross[slab.at(y, x)][number] / kWhole;
            places.push_back({e.column + (e.up ? 0 : share), e.row + (e.up ? share : 0)});
            before[e.following] = int32_t(i);
        }
    }
    // The pixel that the outline goes through from crossing i.
    Place pixel(int32_t i) const {
        const Crossing &a = edges[i], &b = edges[edges[i].following];
        // Halfway between the middles of both edges, times four.
        return {(2 * (a.row + b.row) + a.up + b.up) / 4, (2 * (a.column + b.column) + 2 - a.up - b.up) / 4, kEmpty};
    }
    // The sides before crossing i and after the next one.
    std::array<Vector, 2> sides(int32_t i) const {
        int32_t j = edges[i].following, from = before[i], to = edges[j].following;
        if (is_short(places[i] - places[from])) from = before[from];
        if (is_short(places[to] - places[j])) to = edges[to].following;
        return {places[i] - places[from], places[to] - places[j]};
    }
};

// The area between a side and an arc, as curved as the less curved of its ends: beside a corner the other one tells of
// something else.
double bulge(Vector before, Vector side, Vector after) {
    const double square = dot(side, side), first = curvature(before, side), last = curvature(side, after);
    if (!(first * last > 0)) return 0;
    const double sine = (std::fabs(first) < std::fabs(last) ? first : last) * std::sqrt(square) / 2;  // of half its angle
    // (angle - its sine) / (8 sine^2), by its series.
    return square * sine * (1 + sine * sine * (0.3 + 9. / 56 * sine * sine)) / 6;
}

// How much of the triangle between a, b and the tip lies in the pixel of the tip, if that is beside the one of a and b.
double share_beyond(Vector a, Vector b, Vector tip, const Place& own, const Place& beside) {
    auto along = [&](Vector v) { return own.x == beside.x ? v.y - std::max(own.y, beside.y) : v.x - std::max(own.x, beside.x); };
    double height = along(tip);
    return height == 0 ? 0 : height / (height - along(a)) * (height / (height - along(b)));
}

// How the outline turns after a crossing: what an arc there adds to the inside, pixels; and, where the sides before that
// crossing and after the next one meet, what a corner adds that may be there, 0 for none.
struct Bend {
    int32_t edge;
    double arc, corner;
    bool sharp;  // around one sample in a strip thinner than a pixel, sides turn like a circle's: the field decides
    Vector tip{0, 0}, away{0, 0};  // where they meet, and as far from there as the field must change its sign
    Vector crest{0, 0};  // halfway between the side and the arc

    Bend(const Outline& outline, int32_t i) : edge(i), arc(0), corner(0), sharp(false) {
        const auto [before, after] = outline.sides(i);
        const double turn = det(before, after), most = dot(before, before) * dot(after, after);
        if (!(turn * turn > kStraight * kStraight * most)) return;
        const Vector a = outline.places[i], b = outline.places[outline.edges[i].following];
        const Vector side = b - a;
        arc = bulge(before, side, after);
        sharp = turn * turn > kSine * kSine * most;
        if (!sharp) return;
        // An arc's height is 3/2 of its area over its side; outwards is to the right.
        crest = 0.5 * (a + b) + 0.75 * arc / dot(side, side) * Vector{side.y, -side.x};
        const Place own = outline.pixel(i);
        tip = a + det(side, after) / turn * before, away = unit(unit(before) - unit(after));
        if (std::abs(int(std::floor(tip.y)) - own.y) + std::abs(int(std::floor(tip.x)) - own.x) > 1) return;
        corner = det(tip - a, side) / 2;
        if (std::fabs(corner) < kLeast) corner = 0;
        // An arc is half as far from its chord as its tangents' corner is.
        away = std::clamp(std::fabs(corner) / std::sqrt(dot(side, side)) / 2, kExact, kNear) * away;
    }
    bool may_be_arc() const { return std::fabs(arc) >= kLeast; }
    bool is_doubtful() const { return sharp && may_be_arc(); }
    bool matters() const { return corner != 0 || may_be_arc(); }
};

}  // namespace

// Crossings on the zero set: false position with the Illinois rule (Dowell and Jarratt 1971) or halving, all edges at once. Straight
// lines between the values at both ends would miss it by up to half a pixel where other faces are nearer, as just below a
// horizontal one.
void Slab::project(const std::vector<Edge>& edges) {
    cross.resize(count());
    struct Root {
        float low, high, below, above, share;
        int moved;
        void step(float f) {
            bool lower = (f < 0) == (below < 0);
            const float old = std::fabs(lower ? below : above), from = share;
            if (lower && moved > 0) above /= 2;
            if (!lower && moved < 0) below /= 2;
            (lower ? low : high) = share, (lower ? below : above) = f, moved = lower ? 1 : -1;
            share = low + (high - low) * below / (below - above);
            // A short step that came hardly nearer to zero: values inside a fractal are far smaller than outside, and a
            // straight line between the two creeps along.
            if (std::fabs(share - from) < kPrecise && kNearer * std::fabs(f) > old) share = (low + high) / 2;
        }
    };
    std::vector<Root> roots;
    for (const Edge& e : edges) roots.push_back({0, 1, e.first, e.second, e.first / (e.first - e.second), 0});
    std::vector<int32_t> todo;
    for (size_t i = 0; i < edges.size(); ++i) {
        const Edge& e = edges[i];
        // A crossing is at least |f| over the bound from each end; edges where both distances leave no interval are done.
        const double reach = bounds_.proven * (e.number >> 6 ? frame_.dy : frame_.dx);
        const double low = std::fabs(e.first) / reach, high = 1 - std::fabs(e.second) / reach;
        if (high - low > kTight)
            todo.push_back(int32_t(i));
        else
            roots[i].share = float((low + high) / 2);
    }
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
        std::vector<float> f = values_at(spots);
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
// crossings belong to, or in one beside it. Other sides are arcs, where they turn sharply only if the field agrees.
void Slab::sharpen() {
    const Outline outline(*this);
    std::vector<Bend> turns;
    std::vector<Spot> spots;
    for (int32_t i = 0; i < int32_t(outline.edges.size()); ++i) {
        const Bend turn(outline, i);
        if (turn.matters()) turns.push_back(turn);
        if (turn.corner != 0)
            for (const Vector& spot : {turn.tip + turn.away, turn.tip - turn.away}) spots.push_back({spot.x, spot.y});
        if (turn.is_doubtful()) spots.push_back({turn.crest.x, turn.crest.y});
    }
    const std::vector<float> f = values_at(spots);
    tips.resize(count());
    size_t n = 0;
    for (const Bend& turn : turns) {
        const Place own = outline.pixel(turn.edge), beside{int(std::floor(turn.tip.y)), int(std::floor(turn.tip.x)), kEmpty};
        const bool maybe = turn.corner != 0, is_corner = maybe && (f[n] < 0) != (f[n + 1] < 0);
        if (maybe) n += 2;
        const bool is_arc = turn.is_doubtful() ? (f[n++] < 0) == (turn.arc > 0) : turn.may_be_arc();
        if (!is_corner) {
            if (is_arc) put_tip(own.y, own.x, float(turn.arc));
            continue;
        }
        const Vector a = outline.places[turn.edge], b = outline.places[outline.edges[turn.edge].following];
        const double beyond = own.x == beside.x && own.y == beside.y ? 0 : share_beyond(a, b, turn.tip, own, beside);
        put_tip(own.y, own.x, float(turn.corner * (1 - beyond)));
        if (beyond > 0) put_tip(beside.y, beside.x, float(turn.corner * beyond));
    }
}

void Slab::put_tip(int row, int column, float area) {
    if (row < 0 || column < 0 || row >= kTile * (ty_ - 2) || column >= kTile * (tx_ - 2)) return;
    const int y = row / kTile + 1, x = column / kTile + 1, bit = kTile * (row % kTile) + column % kTile;
    int32_t t = at(y, x);
    if (t < kTiles) t = add(y, x), cross.resize(count()), tips.resize(count());
    const uint64_t cell = uint64_t(1) << bit;
    tips[t][bit] = (sharp[t] & cell ? tips[t][bit] : 0) + area;
    sharp[t] |= cell;
}

}  // namespace fracslice::slices
