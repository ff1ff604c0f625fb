#include "reduction.h"

namespace fracslice::mesh {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// How much of the error allowed is given for a well-shaped triangle.
constexpr double kShape = 0.05;
// The least height of a triangle, in errors allowed.
constexpr double kThin = 1e-3;
// Fraction of the tolerance for a vertex whose collapse was undone.
constexpr float kDistrust = 0.25f;

}  // namespace

Reduction::Reduction(const MeshView& mesh, double tolerance)
    : mesh_(mesh), tolerance_(tolerance), table_(mesh), owner_(mesh.vertices, -1), first_(mesh.count, -1),
      next_(mesh.vertices, -1), due_(mesh.vertices), fresh_(mesh.count), trust_(mesh.vertices, 1), least_(mesh.vertices), busy_(mesh.vertices) {
    for (size_t v = 0; v < mesh.vertices; ++v) {
        if (table_.corner(v) >= 0) put(int32_t(v), table_.corner(v) / 3);
    }
    renew();
}

void Reduction::renew() {
    for (size_t v = 0; v < due_.size(); ++v) due_[v] = table_.corner(v) >= 0;
}

size_t Reduction::sweep(size_t first, size_t last, double share) {
    sweep_ += first == 0;
    size_t done = 0;
    for (size_t v = first; v < last; ++v) {
        double limit = share * double(trust_[v]) * tolerance_;
        if (!due_[v] || busy_[v] == sweep_ || limit == 0 || double(least_[v]) > limit * limit) continue;
        due_[v] = false;
        done += take_out(v, limit);
    }
    return done;
}

bool Reduction::take_out(size_t u, double limit) {
    struct Candidate {
        double cost;
        int to;
        bool operator<(const Candidate& other) const { return cost < other.cost; }
    } candidates[kDegree];
    Star star;
    if (!table_.star(u, star)) return false;
    Fan fan(star, mesh_.positions, mesh_.point(int32_t(u)));
    int count = 0;
    double least = kInfinity, square = limit * limit;
    for (int i = 0; i < star.count; ++i) {
        if (busy_[size_t(star.ring[i])] == sweep_) {
            due_[u] = true, least = 0;
            continue;
        }
        double shape = fan.move(i, kThin * limit);
        if (shape < 0) continue;
        double error = fan.error();
        if (error > square) least = std::min(least, error);
        if (error <= square) candidates[count++] = {std::sqrt(error) + kShape * limit * (1 - shape), i};
    }
    std::sort(candidates, candidates + count);
    if (count) gather(star);
    for (const Candidate* c = candidates; c < candidates + count; ++c) {
        fan.move(c->to, kThin * limit);
        double error = fits(fan, square);
        if (error > square) {
            least = std::min(least, error);
        } else if (!table_.linked(star, c->to) || !fan.covered(square)) {
            least = 0;
        } else {
            star.turn(c->to);
            table_.collapse(star);
            place(star, &Near::after);
            changed(star);
            for (int i = 0; i < star.count; ++i) busy_[size_t(star.ring[i])] = sweep_;
            return true;
        }
    }
    least_[u] = float(least) * 0.999f;  // no more than it is, once rounded
    return false;
}

// Finds a triangle for each point. Returns 0, or the square of a distance beyond the limit that some point has.
double Reduction::fits(const Fan& fan, double limit) {
    for (Near& p : points_) {
        double least;
        p.after = fan.near(mesh_.point(p.vertex), p.before, limit, least);
        if (p.after >= 0) continue;
        std::swap(points_[0], p);  // the next one to be asked
        return least;
    }
    return 0;
}

// The points near the triangles of a star.
void Reduction::gather(const Star& star) {
    points_.clear();
    for (int i = 0; i < star.count; ++i) {
        for (int32_t p = first_[size_t(star.triangle(i))]; p >= 0; p = next_[size_t(p)]) points_.push_back({p, i, 0});
    }
}

// Gives these points, and no others, to triangles of a star.
void Reduction::place(const Star& star, int Near::*where) {
    for (int i = 0; i < star.count; ++i) first_[size_t(star.triangle(i))] = -1;
    for (const Near& p : points_) put(p.vertex, star.triangle(p.*where));
}

void Reduction::put(int32_t v, int32_t t) {
    owner_[size_t(v)] = t;
    next_[size_t(v)] = first_[size_t(t)];
    first_[size_t(t)] = v;
}

void Reduction::changed(const Star& star) {
    for (int i = 0; i < star.count; ++i) {
        fresh_[size_t(star.triangle(i))] = true;
        look_again(star.ring[i]);
    }
}

void Reduction::look_again(int32_t v) { due_[size_t(v)] = true, least_[size_t(v)] = 0; }

void Reduction::undo(const bool* faulty) {
    std::vector<int32_t> steps;
    for (size_t t = 0; t < mesh_.count; ++t) {
        if (int32_t step = faulty[t] ? table_.changed_by(t) : 0) steps.push_back(step);
    }
    std::sort(steps.begin(), steps.end());
    steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
    for (size_t n = steps.size(); n-- > 0;) {
        float& trust = trust_[size_t(table_.vertex(steps[n]))];
        trust = trust == 1 ? kDistrust : 0;
        while (table_.stands(steps[n])) {
            int32_t step = table_.above(steps[n]), u = table_.vertex(step);
            Star star = table_.undo(step);
            Fan fan(star, mesh_.positions, mesh_.point(u));
            gather(star);
            for (Near& p : points_) p.before = fan.nearest(mesh_.point(p.vertex));
            place(star, &Near::before);
            look_again(u);
            changed(star);
        }
    }
}

Reduction::State Reduction::state() {
    State state{{mesh_.count, 3}, {mesh_.count, 1}, {mesh_.count, 1}, {mesh_.count, 1}, {mesh_.vertices, 1}};
    const int32_t* triangles = table_.triangles();
    std::copy_n(triangles, 3 * mesh_.count, state.triangles.data.get());
    std::copy(table_.gone().begin(), table_.gone().end(), state.gone.data.get());
    std::copy(fresh_.begin(), fresh_.end(), state.fresh.data.get());
    std::copy(owner_.begin(), owner_.end(), state.owner.data.get());
    for (size_t t = 0; t < mesh_.count; ++t) state.step.data[t] = table_.changed_by(t);
    std::fill(fresh_.begin(), fresh_.end(), 0);
    return state;
}

}  // namespace fracslice::mesh
