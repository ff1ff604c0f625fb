// W1 as a picture with Phong's shading: `frame OUT.ppm [WIDTH 800] [HEIGHT 600] [SAMPLES 16] [--roots 0] [--runs 5]
// [--threads T]`.
//
// Tiles of 40 x 40 pixels; the rays of a tile march together and are compacted as they end. A ray ends half a pixel before
// the surface by the estimate of its distance; with `--roots 1`, at the first root of the signed field, by the rule of
// fracslice/rendering/units/march.py. "wall_s" and "cpu_s" are of the first sample, "wall16_s" and "cpu16_s" of all.
#include <omp.h>

#include <array>
#include <memory>

#include "geometry.h"
#include "program.h"

using namespace peers;

namespace {

constexpr int TILE = 40, MOST = TILE * TILE + Floats::count, STEPS = 300, ROOT_STEPS = 1600;
constexpr float LIPSCHITZ = 1.0f, RELAXATION = 1.8f, ROUNDING = 1e-7f;  // as fracslice chooses them
constexpr float SPHERE = 1.25f, BACKGROUND[3] = {0.08f, 0.08f, 0.12f};
using Vector = std::array<double, 3>;

Vector operator*(double s, Vector a) { return {s * a[0], s * a[1], s * a[2]}; }
Vector operator+(Vector a, Vector b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
double dot(Vector a, Vector b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector unit(Vector a) { return 1 / std::sqrt(dot(a, a)) * a; }
Vector cross(Vector a, Vector b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// A camera that looks at the origin, 40 degrees high, with a light that goes with it.
struct View {
    int width, height;
    bool roots;
    Vector eye{2.2, -2.0, 1.4}, forward = unit(-1 * eye), right = unit(cross(forward, {0, 0, 1})), up = cross(right, forward);
    double tangent = std::tan(20 * 3.14159265358979323846 / 180);
    Vector light = unit(-0.35 * right + 0.5 * up + -0.8 * forward);
    float pixel = float(2 * tangent / height);

    std::array<float, 3> ray(int x, int y, float across, float down) const {
        const float a = float((2 * (x + across) / width - 1) * tangent * width / height);
        const float b = float((1 - 2 * (y + down) / height) * tangent);
        std::array<float, 3> q;
        for (int k = 0; k < 3; ++k) q[k] = float(forward[k] + a * right[k] + b * up[k]);
        const float inverse = 1 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
        for (float& v : q) v *= inverse;
        return q;
    }
};

// Rays side by side, by coordinate.
struct Rays {
    // radius, stride: the last empty ball, and the step from its centre
    alignas(64) float dx[MOST], dy[MOST], dz[MOST], t[MOST], end[MOST], radius[MOST], stride[MOST];
    int pixel[MOST], count = 0;

    void put(int at, const Rays& from, int i, float distance) {
        dx[at] = from.dx[i];
        dy[at] = from.dy[i];
        dz[at] = from.dz[i];
        end[at] = from.end[i];
        pixel[at] = from.pixel[i];
        radius[at] = from.radius[i];
        stride[at] = from.stride[i];
        t[at] = distance;
    }
};

struct Hits {
    alignas(64) float x[MOST], y[MOST], z[MOST], gx[MOST], gy[MOST], gz[MOST];
    Rays rays;
};

class Tracer {
public:
    Tracer(const View& of, std::vector<float>& sums) : view(of), picture(sums) {}

    // Adds one sample of each pixel of a tile; returns evaluations.
    std::size_t tile(int x0, int y0, float across, float down) {
        start(x0, y0, across, down);
        hits.rays.count = 0;
        evaluations = 0;
        for (int step = 0; step < (view.roots ? ROOT_STEPS : STEPS) && rays.count; ++step) {
            if (view.roots)
                advance();
            else
                march();
        }
        differences();
        for (int i = 0; i < hits.rays.count; ++i) shade(i);
        return evaluations;
    }

private:
    const View& view;
    std::vector<float>& picture;
    Rays rays;
    Hits hits;
    alignas(64) float x[MOST], y[MOST], z[MOST], d[MOST], ends[MOST];
    const Bulb solid;
    std::size_t evaluations = 0;

    void add(int pixel, float r, float g, float b) {
        float* at = &picture[std::size_t(pixel) * 3];
        at[0] += r;
        at[1] += g;
        at[2] += b;
    }
    void miss(int pixel) { add(pixel, BACKGROUND[0], BACKGROUND[1], BACKGROUND[2]); }

    // The rays of a tile from where they enter a sphere around the bulb.
    void start(int x0, int y0, float across, float down) {
        rays.count = 0;
        for (int py = y0; py < std::min(view.height, y0 + TILE); ++py)
            for (int px = x0; px < std::min(view.width, x0 + TILE); ++px) {
                const auto ray = view.ray(px, py, across, down);
                const float b = float(view.eye[0] * ray[0] + view.eye[1] * ray[1] + view.eye[2] * ray[2]);
                const float inner = b * b - float(dot(view.eye, view.eye) - SPHERE * SPHERE);
                if (inner <= 0) {
                    miss(py * view.width + px);
                    continue;
                }
                const int i = rays.count++;
                rays.dx[i] = ray[0];
                rays.dy[i] = ray[1];
                rays.dz[i] = ray[2];
                rays.t[i] = -b - std::sqrt(inner);
                rays.end[i] = -b + std::sqrt(inner);
                rays.pixel[i] = py * view.width + px;
                rays.radius[i] = rays.stride[i] = 0;
            }
    }

    void evaluate(int count) {
        for (int i = 0; i < count; i += Floats::count) value(Floats::load(x + i), Floats::load(y + i), Floats::load(z + i)).store(d + i);
        evaluations += count;
    }

    Floats value(Floats px, Floats py, Floats pz) const { return view.roots ? solid(px, py, pz) : bulb(px, py, pz); }

    static int padded(int count) { return (count + Floats::count - 1) / Floats::count * Floats::count; }

    void march() {
        const int n = padded(rays.count);
        for (int i = rays.count; i < n; ++i) rays.put(i, rays, 0, rays.t[0]);
        const float ex = float(view.eye[0]), ey = float(view.eye[1]), ez = float(view.eye[2]);
        for (int i = 0; i < n; ++i) {
            x[i] = ex + rays.t[i] * rays.dx[i];
            y[i] = ey + rays.t[i] * rays.dy[i];
            z[i] = ez + rays.t[i] * rays.dz[i];
        }
        evaluate(n);
        int left = 0;
        for (int i = 0; i < rays.count; ++i) {
            const float next = rays.t[i] + d[i];
            if (d[i] < 0.5f * view.pixel * rays.t[i]) {
                hit(i);
            } else if (next > rays.end[i]) {
                miss(rays.pixel[i]);
            } else {
                rays.put(left++, rays, i, next);
            }
        }
        rays.count = left;
    }

    // A step of every ray to the root, without branches; then those that ended are replaced by the last ones.
    void advance() {
        const int n = padded(rays.count);
        for (int i = rays.count; i < n; ++i) rays.put(i, rays, 0, rays.t[0]);
        for (int i = 0; i < n; i += Floats::count) advance(i);
        evaluations += n;
        for (int i = rays.count - 1; i >= 0; --i) {
            if (ends[i] == 0) continue;
            if (ends[i] > 1)
                miss(rays.pixel[i]);
            else
                hit(i);
            rays.put(i, rays, rays.count - 1, rays.t[rays.count - 1]);
            --rays.count;
        }
    }

    void advance(int i) {
        const Floats zero(0.0f), one(1.0f), dx = Floats::load(rays.dx + i), dy = Floats::load(rays.dy + i), dz = Floats::load(rays.dz + i);
        const Floats t = Floats::load(rays.t + i), before = Floats::load(rays.radius + i), stride = Floats::load(rays.stride + i);
        const Floats radius = Floats(1 / LIPSCHITZ) * solid(multiply_add(t, dx, Floats(float(view.eye[0]))),
                                                            multiply_add(t, dy, Floats(float(view.eye[1]))),
                                                            multiply_add(t, dz, Floats(float(view.eye[2]))));
        const Floats near = multiply_add(Floats(0.5f * view.pixel), t, Floats(ROUNDING));
        const Floats fall = maximum(before - radius, Floats(1e-30f)), ahead = radius * stride / fall;
        const auto root = greater(Floats(ROUNDING), radius) & ~greater(stride, maximum(before, Floats(4.0f) * near));
        const auto kept = ~greater(stride, maximum(radius, zero) + before);
        const Floats relaxed = maximum(Floats(RELAXATION) * stride / (stride + fall), one) * radius;
        const Floats step = select(greater(Floats(0.5f) * near, ahead), maximum(relaxed, ahead + ahead), relaxed);
        const Floats on = select(kept, t + step, t - stride + before), kept_radius = select(kept, radius, before);
        const Floats kept_step = select(kept, step, before);
        const Floats free = select(greater(kept_step, zero), on - kept_step + kept_radius, on);
        select(root, t + select(greater(zero, radius), ahead, zero), on).store(rays.t + i);
        kept_radius.store(rays.radius + i);
        kept_step.store(rays.stride + i);
        select(root, one, select(greater(free, Floats::load(rays.end + i)), Floats(2.0f), zero)).store(ends + i);
    }

    void hit(int i) {
        const int at = hits.rays.count++;
        hits.x[at] = float(view.eye[0]) + rays.t[i] * rays.dx[i];
        hits.y[at] = float(view.eye[1]) + rays.t[i] * rays.dy[i];
        hits.z[at] = float(view.eye[2]) + rays.t[i] * rays.dz[i];
        hits.rays.put(at, rays, i, rays.t[i]);
    }

    // Gradients by differences over a tetrahedron's corners.
    void differences() {
        constexpr float corners[4][3] = {{1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {1, 1, 1}};
        const int count = hits.rays.count, n = padded(count);
        std::fill(hits.gx, hits.gx + n, 0.0f);
        std::fill(hits.gy, hits.gy + n, 0.0f);
        std::fill(hits.gz, hits.gz + n, 0.0f);
        for (const auto& corner : corners) {
            for (int i = 0; i < n; ++i) {
                const int from = i < count ? i : 0;
                const float reach = 0.5f * view.pixel * hits.rays.t[from];
                x[i] = hits.x[from] + corner[0] * reach;
                y[i] = hits.y[from] + corner[1] * reach;
                z[i] = hits.z[from] + corner[2] * reach;
            }
            if (count) evaluate(n);
            for (int i = 0; i < count; ++i) {
                hits.gx[i] += corner[0] * d[i];
                hits.gy[i] += corner[1] * d[i];
                hits.gz[i] += corner[2] * d[i];
            }
        }
    }

    void shade(int i) {
        float gx = hits.gx[i], gy = hits.gy[i], gz = hits.gz[i];
        const float inverse = 1 / std::sqrt(gx * gx + gy * gy + gz * gz + 1e-30f);
        const float lx = float(view.light[0]), ly = float(view.light[1]), lz = float(view.light[2]);
        const float hx = lx - hits.rays.dx[i], hy = ly - hits.rays.dy[i], hz = lz - hits.rays.dz[i];
        const float diffuse = std::max(0.0f, (gx * lx + gy * ly + gz * lz) * inverse);
        float shine = std::max(0.0f, (gx * hx + gy * hy + gz * hz) * inverse / std::sqrt(hx * hx + hy * hy + hz * hz));
        for (int power = 1; power < 32; power *= 2) shine *= shine;
        const float value = std::min(1.0f, 0.1f + 0.7f * diffuse + 0.3f * shine);
        add(hits.rays.pixel[i], value, value, 0.9f * value);
    }
};

// One sample of every pixel.
std::size_t sample(const View& view, std::vector<float>& sums, int index) {
    const float across = index ? std::fmod(0.5f + index * 0.7548776662f, 1.0f) : 0.5f;
    const float down = index ? std::fmod(0.5f + index * 0.5698402910f, 1.0f) : 0.5f;
    const int columns = (view.width + TILE - 1) / TILE, rows = (view.height + TILE - 1) / TILE;
    std::size_t evaluations = 0;
#pragma omp parallel reduction(+ : evaluations)
    {
        const auto tracer = std::make_unique<Tracer>(view, sums);
#pragma omp for schedule(dynamic, 1)
        for (int t = 0; t < columns * rows; ++t)
            evaluations += tracer->tile(t % columns * TILE, t / columns * TILE, across, down);
    }
    return evaluations;
}

void write_picture(const std::string& path, const View& view, const std::vector<float>& sums, int samples) {
    std::ofstream file(path, std::ios::binary);
    file << "P6 " << view.width << ' ' << view.height << " 255\n";
    for (const float sum : sums) file.put(char(255 * std::min(1.0f, sum / samples)));
}

}  // namespace

int main(int count, char** given) {
    return run(count, given, "OUT.ppm [WIDTH 800] [HEIGHT 600] [SAMPLES 16] [--roots 0] [--runs 5] [--threads T]", [](const Options& options) {
        const auto number = [&](std::size_t at, int otherwise) {
            return options.words.size() > at ? std::stoi(options.words[at]) : otherwise;
        };
        const View view{number(1, 800), number(2, 600), options.whole("roots", 0) != 0};
        const int samples = number(3, 16);
        omp_set_num_threads(options.threads());
        std::vector<float> sums;
        Runs first, all;
        std::size_t evaluations = 0;
        for (int r = 0; r < options.whole("runs", 5); ++r) {
            sums.assign(std::size_t(view.width) * view.height * 3, 0);
            all.time([&] {
                first.time([&] { evaluations = sample(view, sums, 0); });
                for (int s = 1; s < samples; ++s) sample(view, sums, s);
            });
        }
        write_picture(options.word(0, "an output file"), view, sums, samples);
        first.line().add("wall16_s", median(all.walls)).add("cpu16_s", median(all.cpus))
            .add("evals", double(evaluations)).add("worker_peak_mb", peak_mb()).print();
    });
}
