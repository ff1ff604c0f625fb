// Numbers as text, row by row.
#pragma once
#include <span>
#include <string>
#include <vector>

namespace fracslice::mesh {

// Rows of as many numbers as there are texts, each after its own text; `end` ends a row. A float has the fewest digits that
// read back as the same number. `values`: whole rows. Number: float or int64_t.
template <class Number>
std::string text_rows(std::span<const Number> values, const std::vector<std::string>& before, const std::string& end);

}  // namespace fracslice::mesh
