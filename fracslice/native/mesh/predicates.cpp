#include "predicates.h"

#include <array>
#include <cassert>
#include <cfloat>

namespace fracslice::mesh::exact {
namespace {

static_assert(FLT_EVAL_METHOD == 0, "each operation must round to its own type");

using Vec3 = std::array<double, 3>;

// Rounding error of a product: a * b - product, exactly (Dekker, Veltkamp).
double error_of_product(double a, double b, double product) {
    constexpr double splitter = 0x1p27 + 1;
    double t = splitter * a, a_high = t - (t - a), a_low = a - a_high;
    t = splitter * b;
    double b_high = t - (t - b), b_low = b - b_high;
    return a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low);
}

// A sum of numbers that do not overlap, from the smallest to the largest; at most `Size` of them.
template <int Size>
class Expansion {
  public:
    void add(double value) {
        int kept = 0;
        for (int i = 0; i < count_; ++i) {
            double total = value + terms_[i], virtual_value = total - value;
            double rest = (value - (total - virtual_value)) + (terms_[i] - virtual_value);
            value = total;
            if (rest != 0) terms_[kept++] = rest;
        }
        assert(kept < Size || value == 0);
        if (value != 0) terms_[kept++] = value;
        count_ = kept;
    }

    void add_product(double a, double b) {
        double product = a * b;
        add(error_of_product(a, b, product));
        add(product);
    }

    // sign * det(a, b, c): six products of three numbers.
    void add_volume(const Vec3& a, const Vec3& b, const Vec3& c, double sign) {
        for (int k = 0; k < 3; ++k) {
            int i = (k + 1) % 3, j = (k + 2) % 3;
            add_triple(sign * a[k], b[i], c[j]);
            add_triple(sign * a[k], -b[j], c[i]);
        }
    }

    // That of the last term, the largest.
    int sign() const { return count_ == 0 ? 0 : terms_[count_ - 1] > 0 ? 1 : -1; }

  private:
    void add_triple(double x, double y, double z) {
        double product = x * y;
        add_product(error_of_product(x, y, product), z);
        add_product(product, z);
    }

    double terms_[Size];
    int count_ = 0;
};

// Whether a - b is free of rounding, as for most neighbours with float32 coordinates: it saves terms.
bool exact_difference(double a, double b) {
    double difference = a - b, back = a - difference;
    return (a - (difference + back)) + (back - b) == 0;
}

bool exact_differences(const Vec3& a, const Vec3& b) {
    return exact_difference(a[0], b[0]) && exact_difference(a[1], b[1]) && exact_difference(a[2], b[2]);
}

Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

}  // namespace

int side_of_line(double ax, double ay, double bx, double by, double cx, double cy) {
    Expansion<16> sum;
    if (exact_difference(ax, cx) && exact_difference(ay, cy) && exact_difference(bx, cx) && exact_difference(by, cy)) {
        sum.add_product(ax - cx, by - cy);
        sum.add_product(cy - ay, bx - cx);
        return sum.sign();
    }
    sum.add_product(ax, by);
    sum.add_product(-ay, bx);
    sum.add_product(bx, cy);
    sum.add_product(-by, cx);
    sum.add_product(cx, ay);
    sum.add_product(-cy, ax);
    return sum.sign();
}

int side_of_plane(const double* pa, const double* pb, const double* pc, const double* pd) {
    Vec3 a{pa[0], pa[1], pa[2]}, b{pb[0], pb[1], pb[2]}, c{pc[0], pc[1], pc[2]}, d{pd[0], pd[1], pd[2]};
    Expansion<128> sum;
    if (exact_differences(a, d) && exact_differences(b, d) && exact_differences(c, d)) {
        sum.add_volume(minus(a, d), minus(b, d), minus(c, d), 1);
        return sum.sign();
    }
    sum.add_volume(a, b, c, 1);
    sum.add_volume(b, c, d, -1);
    sum.add_volume(c, d, a, 1);
    sum.add_volume(d, a, b, -1);
    return sum.sign();
}

}  // namespace fracslice::mesh::exact
