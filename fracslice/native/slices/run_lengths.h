// Run lengths of pictures, as resin printers read them.
#pragma once
#include "deflate.h"

namespace fracslice::slices {

// Encodings of a picture: rows of a PNG file, each after a byte 0, as a zlib stream; or its levels in one string from row to row.
enum class Encoding {
    png,
    goo,   // .goo V3.0: runs and differences of 8 bits, between a mark and a checksum
    rle7,  // .ctb: 7 bits, lengths of one to four bytes
    rle4,  // .pwmx: 4 bits, lengths of 4 bits, or of 12 where a level is the lowest or highest
    rle1,  // .cbddlp: one bit, lengths of 7 bits
};

// The bytes of an encoding other than `png`, until this thread encodes another.
const Rows<uint8_t>& run_lengths(Runs& runs, Encoding encoding);

}  // namespace fracslice::slices
