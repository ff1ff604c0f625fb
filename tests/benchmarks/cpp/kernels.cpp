// Evaluations per second on one thread: `kernels [N]` prints a line of JSON for each workload, form and set of points.
//
// Sets: "grid", the N^3 cell centres of the workload; "band", those of them whose estimate is under four voxels and not 0.
// --points FOLDER: writes each set, e.g. W1-band: float64, all x, then all y, then all z.
#include <cstdlib>
#include <random>

#include "geometry.h"
#include "program.h"

using namespace peers;

namespace {

template <class T> struct Points {
    std::vector<T> x, y, z;

    void add(T a, T b, T c) {
        x.push_back(a);
        y.push_back(b);
        z.push_back(c);
    }
    // To a whole number of lanes of any kind.
    void truncate() {
        const std::size_t whole = x.size() / 32 * 32;
        for (auto* axis : {&x, &y, &z}) axis->resize(whole);
    }
};

template <class T> Points<T> grid(const Workload& work, int n, double band) {
    Points<T> points;
    const double h = (work.hi - work.lo) / n;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            for (int k = 0; k < n; ++k) {
                const double x = work.lo + (i + 0.5) * h, y = work.lo + (j + 0.5) * h, z = work.lo + (k + 0.5) * h;
                const double d = band > 0 ? estimate(work.shape, x, y, z) : 1;
                if (band <= 0 || (d != 0 && std::fabs(d) < band * h)) points.add(T(x), T(y), T(z));
            }
    points.truncate();
    return points;
}

template <class T> void evaluate(Shape shape, const Points<T>& p, std::vector<T>& out, T) {
    for (std::size_t i = 0; i < p.x.size(); ++i) out[i] = estimate(shape, p.x[i], p.y[i], p.z[i]);
}

template <class V, class T> void evaluate_lanes(Shape shape, const Points<T>& p, std::vector<T>& out) {
    for (std::size_t i = 0; i < p.x.size(); i += V::count)
        estimate(shape, V::load(&p.x[i]), V::load(&p.y[i]), V::load(&p.z[i])).store(&out[i]);
}

template <class T, class F> void measure(const std::string& work, const char* form, const char* set,
                                         const Points<T>& points, int runs, F evaluation) {
    if (points.x.empty()) return;
    std::vector<T> out(points.x.size());
    std::vector<double> seconds;
    for (int run = 0; run < runs; ++run) {
        const double start = cpu();
        evaluation(points, out);
        seconds.push_back(cpu() - start);
    }
    Line line;
    line.name("workload", work).name("form", form).name("points", set).add("n", double(out.size()));
    line.add("million_per_s", out.size() / median(seconds) / 1e6).print();
}

void write_points(const std::string& path, const Points<double>& points) {
    std::ofstream file(path, std::ios::binary);
    for (const auto* axis : {&points.x, &points.y, &points.z})
        file.write(reinterpret_cast<const char*>(axis->data()), std::streamsize(axis->size() * sizeof(double)));
    if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

template <class T, class V, class Two> void suite(const std::string& name, int n, int runs, const char* kind) {
    const Workload work = workload(name);
    for (const double band : {0.0, 4.0}) {
        const Points<T> points = grid<T>(work, n, band);
        const char* set = band > 0 ? "band" : "grid";
        const auto form = [&](const char* shape) { return std::string(shape) + "_" + kind; };
        measure(name, form("scalar").c_str(), set, points, runs,
                [&](const Points<T>& p, std::vector<T>& out) { evaluate(work.shape, p, out, T()); });
        measure(name, form("lanes").c_str(), set, points, runs,
                [&](const Points<T>& p, std::vector<T>& out) { evaluate_lanes<V>(work.shape, p, out); });
        measure(name, form("two_lanes").c_str(), set, points, runs,
                [&](const Points<T>& p, std::vector<T>& out) { evaluate_lanes<Two>(work.shape, p, out); });
    }
}

// Lanes against float64 points, at random places in the cube: a peer that computes something else is no peer.
template <class V> double worst_difference(Shape shape) {
    using T = typename V::Value;
    std::mt19937 generator(1);
    std::uniform_real_distribution<double> place(-1.2, 1.2);
    double worst = 0;
    for (int round = 0; round < 4000; ++round) {
        T at[3][V::count], out[V::count];
        for (auto& axis : at)
            for (T& value : axis) value = T(place(generator));
        estimate(shape, V::load(at[0]), V::load(at[1]), V::load(at[2])).store(out);
        for (int i = 0; i < V::count; ++i) {
            const double exact = estimate(shape, double(at[0][i]), double(at[1][i]), double(at[2][i]));
            worst = std::max(worst, std::fabs(out[i] - exact));
        }
    }
    return worst;
}

}  // namespace

int main(int count, char** given) {
    return run(count, given, "[N] [--runs 5] [--points FOLDER]", [](const Options& options) {
        const int n = options.words.empty() ? 128 : std::stoi(options.words[0]);
        const int runs = options.whole("runs", 5);
        const auto folder = options.named.find("points");
        for (const std::string name : {"W1", "W2", "W3", "W4"}) {
            const Shape shape = workload(name).shape;
            if (folder != options.named.end())
                for (const double band : {0.0, 4.0})
                    write_points(folder->second + "/" + name + (band > 0 ? "-band" : "-grid"),
                                 grid<double>(workload(name), n, band));
            Line().name("workload", name).add("worst_float32", worst_difference<FloatLanes>(shape))
                .add("worst_float64", worst_difference<DoubleLanes>(shape)).print();
            suite<float, FloatLanes, Floats>(name, n, runs, "float32");
            suite<double, DoubleLanes, Doubles>(name, n, runs, "float64");
        }
    });
}
