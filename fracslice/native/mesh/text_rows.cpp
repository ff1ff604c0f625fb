#include "text_rows.h"

#include <cassert>
#include <charconv>
#include <cstdint>

namespace fracslice::mesh {
namespace {

constexpr size_t kLongest = 24;  // characters of a number

}  // namespace

template <class Number>
std::string text_rows(std::span<const Number> values, const std::vector<std::string>& before, const std::string& end) {
    const size_t columns = before.size();
    assert(columns > 0 && values.size() % columns == 0);
    size_t longest = end.size() + kLongest * columns;
    for (const std::string& text : before) longest += text.size();
    std::string result(values.size() / columns * longest, '\0');
    char* to = result.data();
    for (size_t i = 0; i < values.size(); i += columns) {
        for (size_t k = 0; k < columns; ++k) {
            to += before[k].copy(to, before[k].size());
            to = std::to_chars(to, to + kLongest, values[i + k]).ptr;
        }
        to += end.copy(to, end.size());
    }
    result.resize(size_t(to - result.data()));
    return result;
}

template std::string text_rows(std::span<const float>, const std::vector<std::string>&, const std::string&);
template std::string text_rows(std::span<const int64_t>, const std::vector<std::string>&, const std::string&);

}  // namespace fracslice::mesh
