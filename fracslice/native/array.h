// Arrays that become NumPy's: uninitialised rows of numbers.
#pragma once
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace fracslice {

struct Free {
    void operator()(void* p) const { std::free(p); }
};

// Memory in huge pages where the system has them: laying hundreds of megabytes in small ones takes a third of the time of
// meshing. Freed by std::free.
inline void* allocate(size_t bytes) {
    constexpr size_t page = size_t(1) << 21;
    size_t whole = (bytes + page - 1) / page * page;
    void* p = whole <= 2 * page ? std::malloc(bytes + 1) : std::aligned_alloc(page, whole);
    if (!p) throw std::bad_alloc();
#if defined(__linux__)
    if (whole > 2 * page) madvise(p, whole, MADV_HUGEPAGE);
#endif
    return p;
}

template <class T>
struct Array {
    std::unique_ptr<T[], Free> data;
    size_t rows = 0;

    Array() = default;
    // Left uninitialised: every element is written by the thread that makes it, which is also where its page is laid.
    Array(size_t n, size_t columns) : data(static_cast<T*>(allocate(n * columns * sizeof(T)))), rows(n) {}
};

}  // namespace fracslice
