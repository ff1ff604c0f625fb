// W1 as print slices, PNG of one bit: `slices FOLDER [SIDE 1024] [LAYERS 512] [--threads T]`.
//
// Blocks of 64 x 64 pixels and eight layers are dropped or cut in four down to 16 x 16, then every pixel is evaluated.
#include <omp.h>
#include <sys/stat.h>
#include <zlib.h>

#include <cstring>

#include "geometry.h"
#include "program.h"

using namespace peers;

namespace {

constexpr int SLAB = 8, LARGE = 64, SMALL = 16;

void big_endian(std::vector<std::uint8_t>& out, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) out.push_back(std::uint8_t(value >> shift));
}

void chunk(std::vector<std::uint8_t>& out, const char* name, const std::uint8_t* data, std::size_t size) {
    big_endian(out, std::uint32_t(size));
    const std::size_t start = out.size();
    out.insert(out.end(), name, name + 4);
    if (size) out.insert(out.end(), data, data + size);
    big_endian(out, std::uint32_t(crc32(0, &out[start], uInt(size + 4))));
}

// rows: packed pixels, each row after a byte 0, as PNG has them.
std::size_t write_png(const std::string& path, const std::uint8_t* rows, int side) {
    std::vector<std::uint8_t> out = {0x89, 'P', 'N', 'G', 13, 10, 26, 10}, head;
    big_endian(head, side);
    big_endian(head, side);
    head.insert(head.end(), {1, 0, 0, 0, 0});
    chunk(out, "IHDR", head.data(), head.size());
    const uLong raw = uLong(side) * (side / 8 + 1);
    uLongf size = compressBound(raw);
    std::vector<std::uint8_t> packed(size);
    compress2(packed.data(), &size, rows, raw, 1);
    chunk(out, "IDAT", packed.data(), size);
    chunk(out, "IEND", nullptr, 0);
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(out.data()), out.size());
    return out.size();
}

// The first pixel is the highest bit.
std::uint8_t reversed(std::uint8_t bits) { return (bits * 0x0202020202ull & 0x010884422010ull) % 1023; }

struct Job {
    int side, layers, stride;
    float lo, pixel, height, iso;

    Job(int pixels, int count)
        : side(pixels), layers(count), stride(pixels / 8 + 1), lo(float(workload("W1").lo)),
          pixel(2 * -lo / pixels), height(2 * -lo / count), iso(0.5f * height) {}
};

struct Block {
    int x, y, size;
};

struct Slab {
    const Job& job;
    int first;
    std::vector<std::uint8_t> rows;
    std::size_t inside = 0, evaluations = 0;

    Slab(const Job& of, int layer) : job(of), first(layer), rows(std::size_t(SLAB) * of.side * of.stride, 0) {}

    bool empty(const Block& b) {
        const float x = job.lo + (b.x + 0.5f * b.size) * job.pixel, y = job.lo + (b.y + 0.5f * b.size) * job.pixel;
        const float z = job.lo + (first + 0.5f * SLAB) * job.height;
        const float across = 0.5f * b.size * job.pixel, up = 0.5f * SLAB * job.height;
        ++evaluations;
        return bulb(x, y, z) > std::sqrt(2 * across * across + up * up) + 4 * job.iso;
    }

    // Lanes run along x, and over as many rows as they reach.
    void evaluate(const Block& b) {
        alignas(64) float x[Floats::count], y[Floats::count];
        for (int layer = 0; layer < SLAB; ++layer) {
            const Floats z(job.lo + (first + layer + 0.5f) * job.height);
            for (int i = 0; i < b.size * b.size; i += Floats::count) {
                for (int lane = 0; lane < Floats::count; ++lane) {
                    x[lane] = job.lo + (b.x + (i + lane) % b.size + 0.5f) * job.pixel;
                    y[lane] = job.lo + (b.y + (i + lane) / b.size + 0.5f) * job.pixel;
                }
                const std::uint32_t mask = greater(Floats(job.iso), bulb(Floats::load(x), Floats::load(y), z));
                evaluations += Floats::count;
                inside += __builtin_popcount(mask);
                for (int lane = 0; lane < Floats::count; lane += 8) {
                    const int px = b.x + (i + lane) % b.size, py = b.y + (i + lane) / b.size;
                    rows[(std::size_t(layer) * job.side + py) * job.stride + 1 + px / 8] = reversed(std::uint8_t(mask >> lane));
                }
            }
        }
    }

    void fill() {
        std::vector<Block> todo;
        for (int y = 0; y < job.side; y += LARGE)
            for (int x = 0; x < job.side; x += LARGE) todo.push_back({x, y, LARGE});
        while (!todo.empty()) {
            const Block b = todo.back();
            todo.pop_back();
            if (empty(b)) continue;
            const int half = b.size / 2;
            if (b.size == SMALL) evaluate(b);
            else for (int q = 0; q < 4; ++q) todo.push_back({b.x + (q & 1) * half, b.y + (q >> 1) * half, half});
        }
    }
};

}  // namespace

int main(int count, char** given) {
    return run(count, given, "FOLDER [SIDE 1024] [LAYERS 512] [--threads T]", [](const Options& options) {
        const std::string folder = options.word(0, "a folder");
        const auto number = [&](std::size_t at, int otherwise) {
            return options.words.size() > at ? std::stoi(options.words[at]) : otherwise;
        };
        const Job job(number(1, 1024), number(2, 512));
        if (job.side % LARGE || job.layers % SLAB) throw std::invalid_argument("expected a SIDE in 64, LAYERS in 8");
        mkdir(folder.c_str(), 0755);
        omp_set_num_threads(options.threads());
        std::size_t inside = 0, bytes = 0, evaluations = 0;
        Runs runs;
        runs.time([&] {
#pragma omp parallel for schedule(dynamic, 1) reduction(+ : inside, bytes, evaluations)
            for (int first = 0; first < job.layers; first += SLAB) {
                Slab slab(job, first);
                slab.fill();
                inside += slab.inside;
                evaluations += slab.evaluations;
                for (int k = 0; k < SLAB; ++k) {
                    char name[32];
                    std::snprintf(name, sizeof name, "/%04d.png", first + k);
                    bytes += write_png(folder + name, &slab.rows[std::size_t(k) * job.side * job.stride], job.side);
                }
            }
        });
        runs.line().add("inside_px", double(inside)).add("bytes", double(bytes)).add("evals", double(evaluations))
            .add("worker_peak_mb", peak_mb()).print();
    });
}
