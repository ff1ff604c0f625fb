// The checksum of PNG and ZIP files.
#pragma once
#include <cstddef>
#include <cstdint>

namespace fracslice {

// CRC-32 of bytes, after those whose it is `before`.
uint32_t crc32(const uint8_t* data, size_t n, uint32_t before = 0);

}  // namespace fracslice
