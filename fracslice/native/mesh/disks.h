// Disks of triangles, each seen in full from a vertex.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace fracslice::mesh {

// Triangles of a disk, and those of the fan around a vertex that has its rim.
struct Disk {
    std::vector<int64_t> triangles;
    std::vector<std::array<int32_t, 3>> fan;
};

struct DiskLimits {
    double thin;   // minimum height of a triangle of a fan, scene units
    double sharp;  // minimum cosine between its normal and one of the disk
    size_t most;   // maximum triangles of a disk
};

// `beyond`: the triangle beyond each side, or -1; `normals` of the surface at the triangles; `alike`: the same, rounded: of those that
// are equal the first one counts; `fixed`: vertices that stay.
class Disks {
  public:
    using Vector3 = std::array<double, 3>;
    using Sides = std::array<int64_t, 3>;
    using Corners = std::array<int32_t, 3>;

    Disks(std::span<const Corners> triangles, std::span<const Sides> beyond, std::span<const Vector3> vertices,
          std::span<const Vector3> normals, std::span<const Vector3> alike, std::span<const bool> fixed, const DiskLimits& limits)
        : triangles_(triangles), beyond_(beyond), vertices_(vertices), normals_(normals), alike_(alike), fixed_(fixed), limits_(limits),
          starts_(vertices.size() + 1) {
        for (const Corners& t : triangles_) {
            for (int32_t v : t) ++starts_[size_t(v) + 1];
        }
        for (size_t v = 1; v < starts_.size(); ++v) starts_[v] += starts_[v - 1];
        star_.resize(3 * triangles_.size());
        std::vector<size_t> at(starts_.begin(), starts_.end() - 1);
        for (size_t t = 0; t < triangles_.size(); ++t) {
            for (int32_t v : triangles_[t]) star_[at[size_t(v)]++] = int64_t(t);
        }
    }

    // The disk with the star of a vertex, grown until the fan around that vertex faces as the disk does. None if there is no such
    // disk, or if it would swallow a fixed vertex.
    std::optional<Disk> grown(int32_t apex) const {
        std::vector<int64_t> more(star_.begin() + ptrdiff_t(starts_[size_t(apex)]), star_.begin() + ptrdiff_t(starts_[size_t(apex) + 1]));
        std::vector<int64_t> disk;
        std::vector<size_t> facing;  // triangles whose normals count
        std::vector<std::array<int32_t, 2>> rim;
        while (!more.empty() && disk.size() + more.size() <= limits_.most) {
            disk.insert(disk.end(), more.begin(), more.end());
            sort_unique(disk);
            for (int64_t t : more) {
                auto same = [&](size_t other) { return alike_[other] == alike_[size_t(t)]; };
                if (std::none_of(facing.begin(), facing.end(), same)) facing.push_back(size_t(t));
            }
            rim.clear();
            more.clear();
            for (int64_t t : disk) {
                const Corners& corners = triangles_[size_t(t)];
                for (int k = 0; k < 3; ++k) {
                    const int64_t other = beyond_[size_t(t)][size_t(k)];
                    if (std::binary_search(disk.begin(), disk.end(), other)) continue;
                    const int32_t a = corners[size_t(k)], b = corners[size_t((k + 1) % 3)];
                    if (a != apex && b != apex && sees(a, b, apex, facing)) {
                        rim.push_back({a, b});
                    } else if (other < 0) {
                        return {};
                    } else {
                        more.push_back(other);
                    }
                }
            }
            sort_unique(more);
        }
        if (!more.empty()) return {};
        return fan(std::move(disk), rim, apex);
    }

  private:
    template <class Number>
    static void sort_unique(std::vector<Number>& numbers) {
        std::sort(numbers.begin(), numbers.end());
        numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    }

    // Whether the triangle of a side and a vertex faces as one of the normals says, and is not thin.
    bool sees(int32_t a, int32_t b, int32_t c, const std::vector<size_t>& facing) const {
        const Vector3 &p = vertices_[size_t(a)], &q = vertices_[size_t(b)], &r = vertices_[size_t(c)];
        const double ux = q[0] - p[0], uy = q[1] - p[1], uz = q[2] - p[2], vx = r[0] - p[0], vy = r[1] - p[1], vz = r[2] - p[2];
        const double x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
        const double wx = vx - ux, wy = vy - uy, wz = vz - uz;
        const double side = std::max({ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz});
        const double square = x * x + y * y + z * z, least = limits_.sharp * std::sqrt(square);
        if (!(square >= limits_.thin * limits_.thin * side)) return false;
        return std::any_of(facing.begin(), facing.end(), [&](size_t t) {
            const Vector3& n = normals_[t];
            return x * n[0] + y * n[1] + z * n[2] >= least;
        });
    }

    std::optional<Disk> fan(std::vector<int64_t> disk, std::vector<std::array<int32_t, 2>> rim, int32_t apex) const {
        std::vector<int32_t> inside;
        for (int64_t t : disk) inside.insert(inside.end(), triangles_[size_t(t)].begin(), triangles_[size_t(t)].end());
        sort_unique(inside);
        const size_t sides = rim.size();
        const ptrdiff_t euler = ptrdiff_t(inside.size()) - ptrdiff_t(3 * disk.size() + sides) / 2 + ptrdiff_t(disk.size());
        std::sort(rim.begin(), rim.end());
        auto begins = [](const auto& a, const auto& b) { return a[0] == b[0]; };
        if (!sides || euler != 1 || std::adjacent_find(rim.begin(), rim.end(), begins) != rim.end()) return {};
        Disk result{std::move(disk), {}};
        std::vector<int32_t> loop;
        for (int32_t here = rim.front()[0]; loop.size() < sides;) {
            auto next = std::lower_bound(rim.begin(), rim.end(), std::array<int32_t, 2>{here, INT32_MIN});
            if (next == rim.end() || (*next)[0] != here || (!loop.empty() && here == rim.front()[0])) return {};
            loop.push_back(here);
            result.fan.push_back({here, (*next)[1], apex});
            here = (*next)[1];
        }
        if (result.fan.back()[1] != rim.front()[0]) return {};
        std::sort(loop.begin(), loop.end());
        for (int32_t v : inside) {
            if (v != apex && fixed_[size_t(v)] && !std::binary_search(loop.begin(), loop.end(), v)) return {};
        }
        return result;
    }

    std::span<const Corners> triangles_;
    std::span<const Sides> beyond_;
    std::span<const Vector3> vertices_, normals_, alike_;
    std::span<const bool> fixed_;
    DiskLimits limits_;
    std::vector<size_t> starts_;  // of the triangles around a vertex, in star_
    std::vector<int64_t> star_;
};

}  // namespace fracslice::mesh
