// The outlines of a layer, exactly: crossings projected to the surface, corners and bends within pixels.
#include "marching_squares.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>

#include "coverage.h"
#include "slab.h"

namespace fracslice::slices {
namespace {

// Sets a span of pixels of one row.
void fill(const Canvas& canvas, int y, int x, int n) {
    uint8_t* first = canvas.data + y * canvas.down + x * canvas.across;
    if (canvas.across == 1 || canvas.across == -1)
        std::memset(canvas.across > 0 ? first : first - (n - 1), 255, size_t(n));
    else
        for (int i = 0; i < n; ++i) first[i * canvas.across] = 255;
}

// The pixels of a tile that are on it.
uint64_t on(const Canvas& canvas, int y0, int x0) {
    const int rows = std::min(canvas.rows - y0, kTile), columns = std::min(canvas.columns - x0, kTile);
    return kAll >> 8 * (kTile - rows) & kAll / 255 * (0xFF >> (kTile - columns));
}

// The outline of a cell's inside, counter-clockwise, leaves along one edge and comes back along another.
void link(const Sides& sides, int signs, const int32_t* e, std::vector<Crossing>& edges) {
    bool alone = (signs == 5 && !Cells::joined(sides, 0)) || (signs == 10 && !Cells::joined(sides, 1));
    for (int q = 0; q < 4; ++q) {
        int g = (q + 1) & 3;
        if (!(signs >> q & 1) || signs >> g & 1) continue;
        int to = alone ? (q + 3) & 3 : g;
        while (!alone && !(signs >> ((to + 1) & 3) & 1)) to = (to + 1) & 3;
        edges[e[q]].following = e[to];
    }
}

}  // namespace

Painted paint(const Slab& slab, const Canvas& canvas) {
    Painted painted{0, 0};
    Coverage coverage(slab);
    Levels levels;
    for (int y = 1; y < slab.rows() - 1; ++y) {
        int y0 = kTile * (y - 1), full = 0;  // tiles before this one that are full
        if (y0 >= canvas.rows) break;
        for (int x = 1; x < slab.columns(); ++x) {
            int32_t t = slab.at(y, x);
            int x0 = kTile * (x - 1);
            bool empty = t == kEmpty || x0 >= canvas.columns;
            const Quad tiles(slab, {y, empty ? 0 : x, kEmpty});
            const Corners corners(slab, tiles);
            uint64_t sharp = slab.tiles().sharp[t];
            if (!empty && corners.whole() == kAll && !sharp) {
                ++full;
                continue;
            }
            if (full) {
                int first = x0 - kTile * full, n = std::min(x0, canvas.columns) - first;
                for (int r = y0; r < std::min(y0 + kTile, canvas.rows); ++r) fill(canvas, r, first, n);
                painted.area += kTile * kTile * double(full);
                full = 0;
            }
            const uint64_t cut = empty || t < kTiles ? 0 : corners.mixed() | sharp;
            if (!cut) continue;
            coverage(tiles, corners, levels);
            painted.partly += std::popcount(cut);
            each((cut | corners.whole()) & on(canvas, y0, x0), [&](int bit) {
                canvas.data[(y0 + (bit >> 3)) * canvas.down + (x0 + (bit & 7)) * canvas.across] = levels[bit];
            });
        }
    }
    painted.area += coverage.area();
    return painted;
}

Crossings crossings(const Slab& slab) {
    Crossings result;
    const int32_t first = kTiles, end = int32_t(slab.tiles().count());
    std::unique_ptr<int32_t[]> ids(new int32_t[size_t(end - first) * 128]);
    auto id = [&](int32_t t, int number) -> int32_t& { return ids[128 * size_t(t - first) + number]; };
    for (int y = 1; y < slab.rows() - 1; ++y)
        for (int x = 1; x < slab.columns() - 1; ++x) {
            int32_t t = slab.at(y, x);
            if (t < kTiles) continue;
            uint64_t of = slab.tiles().inside[t];
            uint64_t words[2] = {of ^ rights(of, slab.word(y, x + 1)), of ^ uppers(of, slab.word(y + 1, x))};
            for (uint64_t w = words[0] | words[1]; w; w &= w - 1)
                slab.crossed(t, w & -w, [&, t = t](int number, float a, float b) {
                    id(t, number) = int32_t(result.edges.size());
                    result.edges.push_back({kTile * (x - 1) + (number & 7), kTile * (y - 1) + (number >> 3 & 7), number >> 6, -1});
                    result.ends.push_back(a);
                    result.ends.push_back(b);
                });
        }
    for (int y = 1; y < slab.rows() - 1; ++y)
        for (int x = 1; x < slab.columns() - 1; ++x) {
            int32_t t = slab.at(y, x);
            if (t < kTiles) continue;
            const Quad tiles(slab, {y, x, kEmpty});
            const Corners corners(slab, tiles);
            const Cells cells(slab, slab.scale(), tiles);
            for (uint64_t mixed = corners.mixed(); mixed; mixed &= mixed - 1) {
                int bit = std::countr_zero(mixed);
                int32_t right = (bit & 7) == 7 ? std::max(slab.at(y, x + 1), first) : t;
                int32_t upper = bit >> 3 == 7 ? std::max(slab.at(y + 1, x), first) : t;
                const int32_t e[4] = {id(t, bit), id(right, 64 + (bit & 56) + ((bit + 1) & 7)), id(upper, (bit + 8) & 63),
                                      id(t, 64 + bit)};
                link(cells.sides(bit), corners.signs(bit), e, result.edges);
            }
        }
    return result;
}

namespace {

constexpr uint8_t kSolid = 128;  // the coverage from which a pixel is solid

// Eight rows of pixels, tile by tile, that become runs.
class Turns {
 public:
    // The next tile, which begins at a column: its solid pixels.
    void add(int column, uint64_t solid) {
        if (solid == within_) return;
        for (int row = 0; row < kTile; ++row) {
            uint8_t bits = uint8_t(solid >> kTile * row), before = uint8_t(within_ >> kTile * row);
            for (unsigned turns = (bits ^ (bits << 1 | before >> 7)) & 0xFF; turns; turns &= turns - 1)
                columns_[row].push_back(column + std::countr_zero(turns));
        }
        within_ = ((solid & kLastColumn) >> 7) * 0xFF;
    }
    // After the last tile: the runs of the first `rows` rows.
    void end(int column, int rows, SolidRuns& result) {
        add(column, 0);
        for (int row = 0; row < kTile; ++row) {
            auto& turns = columns_[row];
            for (size_t i = 0; row < rows && i < turns.size(); i += 2) result.runs.push_back({turns[i], turns[i + 1]});
            if (row < rows) result.rows.push_back(int32_t(result.runs.size()));
            turns.clear();
        }
    }

 private:
    std::array<std::vector<int32_t>, kTile> columns_;  // columns where solid pixels begin or end, in turn
    uint64_t within_ = 0;                            // the rows in which a run has begun, a byte each
};

}  // namespace

SolidRuns solid_runs(const Slab& slab, int rows, int columns) {
    SolidRuns result{{0}, {}, {0, 0}};
    Coverage coverage(slab);
    Levels levels;
    Turns turns;
    int64_t full = 0;
    for (int y = 1; kTile * (y - 1) < rows; ++y) {
        for (int x = 1; kTile * (x - 1) < columns; ++x) {
            const int32_t t = slab.at(y, x);
            if (t == kEmpty) {
                turns.add(kTile * (x - 1), 0);
                continue;
            }
            const Quad tiles(slab, {y, x, kEmpty});
            const Corners corners(slab, tiles);
            const uint64_t sharp = slab.tiles().sharp[t], cut = t < kTiles ? 0 : corners.mixed() | sharp;
            const bool whole = t != kEmpty && corners.whole() == kAll && !sharp;
            uint64_t solid = whole ? kAll : 0;
            full += whole;
            if (cut) {
                coverage(tiles, corners, levels);
                result.painted.partly += std::popcount(cut);
                each(cut | corners.whole(), [&](int bit) { solid |= uint64_t(levels[bit] >= kSolid) << bit; });
            }
            const int left = columns - kTile * (x - 1);
            turns.add(kTile * (x - 1), left < kTile ? solid & kAll / 255 * (0xFF >> (kTile - left)) : solid);
        }
        turns.end(columns, std::min(rows - kTile * (y - 1), kTile), result);
    }
    result.painted.area = coverage.area() + kTile * kTile * double(full);
    return result;
}

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
void FieldSlab::project(const std::vector<Edge>& edges) {
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
void FieldSlab::sharpen() {
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

void FieldSlab::put_tip(int row, int column, float area) {
    if (row < 0 || column < 0 || row >= kTile * (ty_ - 2) || column >= kTile * (tx_ - 2)) return;
    const int y = row / kTile + 1, x = column / kTile + 1, bit = kTile * (row % kTile) + column % kTile;
    int32_t t = at(y, x);
    if (t < kTiles) t = add(y, x), cross.resize(count()), tips.resize(count());
    const uint64_t cell = uint64_t(1) << bit;
    tips[t][bit] = (sharp[t] & cell ? tips[t][bit] : 0) + area;
    sharp[t] |= cell;
}

}  // namespace fracslice::slices
