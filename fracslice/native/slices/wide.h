// Functions for machines that have AVX-512, beside those for any machine.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#define FRACSLICE_WIDE __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi,avx512vbmi2,bmi,bmi2,popcnt")))
#endif

namespace fracslice {

// Whether this machine has it, unless the environment says otherwise, so that tests see both ways.
bool has_wide();
inline const bool kWide = has_wide();

}  // namespace fracslice
