// Filters of PNG rows (ISO/IEC 15948, clause 9).
#pragma once
#include <cstddef>
#include <cstdint>

namespace fracslice::slices {

// Rows of bytes after the first one, which is that above them, each behind the number of the filter whose bytes have the
// smallest sum of absolute values, as signed numbers; `pixel` is the number of bytes of a pixel.
void filter_rows(const uint8_t* rows, size_t count, size_t width, size_t pixel, uint8_t* out);

}  // namespace fracslice::slices
