// What every peer's program has: options, clocks, a line of JSON, the file of a mesh.
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace peers {

inline double wall() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

inline rusage usage() {
    rusage used;
    getrusage(RUSAGE_SELF, &used);
    return used;
}

inline double cpu() {
    const rusage u = usage();
    return u.ru_utime.tv_sec + u.ru_stime.tv_sec + 1e-6 * (u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

inline double peak_mb() { return usage().ru_maxrss / 1024.0; }

inline double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values.at(values.size() / 2);
}

// Words, then options as `--name value`.
struct Options {
    std::vector<std::string> words;
    std::map<std::string, std::string> named;

    Options(int count, char** given) {
        for (int i = 1; i < count; ++i) {
            const std::string word = given[i];
            if (word.rfind("--", 0) != 0) {
                words.push_back(word);
            } else {
                if (i + 1 == count) throw std::invalid_argument(word + ": expected a value");
                named[word.substr(2)] = given[++i];
            }
        }
    }
    int whole(const std::string& name, int otherwise) const {
        const auto found = named.find(name);
        return found == named.end() ? otherwise : std::stoi(found->second);
    }
    int threads() const { return whole("threads", int(std::thread::hardware_concurrency())); }
    const std::string& word(std::size_t index, const char* what) const {
        if (index >= words.size()) throw std::invalid_argument(std::string("expected ") + what);
        return words[index];
    }
};

// A JSON object, numbers only, on one line of standard output.
class Line {
public:
    Line& add(const std::string& name, double value) {
        char number[64];
        std::snprintf(number, sizeof number, "%.10g", value);
        text += (text.empty() ? "{\"" : ", \"") + name + "\": " + number;
        return *this;
    }
    Line& name(const std::string& key, const std::string& value) {
        text += (text.empty() ? "{\"" : ", \"") + key + "\": \"" + value + "\"";
        return *this;
    }
    void print() const {
        std::printf("%s}\n", text.c_str());
        std::fflush(stdout);
    }

private:
    std::string text;
};

// Wall and CPU seconds of some runs; the medians are told.
struct Runs {
    std::vector<double> walls, cpus;

    template <class F> void time(F run) {
        const double w = wall(), c = cpu();
        run();
        walls.push_back(wall() - w);
        cpus.push_back(cpu() - c);
    }
    Line line() const { return Line().add("wall_s", median(walls)).add("cpu_s", median(cpus)); }
};

// int64 counts of points and triangles, then float32 points and uint32 triangles.
inline void write_mesh(const std::string& path, const float* points, std::int64_t count,
                       const std::vector<std::uint32_t>& triangles) {
    std::ofstream file(path, std::ios::binary);
    const std::int64_t counts[2] = {count, std::int64_t(triangles.size() / 3)};
    const auto put = [&](const void* data, std::size_t size) { file.write(static_cast<const char*>(data), size); };
    put(counts, sizeof counts);
    put(points, std::size_t(count) * 3 * sizeof(float));
    put(triangles.data(), triangles.size() * sizeof(std::uint32_t));
    if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

// Runs a program; what goes wrong is one line and exit status 2.
template <class F> int run(int count, char** given, const char* usage_text, F body) {
    try {
        body(Options(count, given));
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\nusage: %s %s\n", given[0], error.what(), given[0], usage_text);
        return 2;
    }
}

}  // namespace peers
