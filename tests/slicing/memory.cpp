// Tiles are given back when there is no memory left, as the destructor of a slab does while an error is on its way.
#include <cstdlib>
#include <new>

#include "slab.h"

static bool full = false;

void* operator new(std::size_t size) {
    void* p = full ? nullptr : std::malloc(size);
    if (!p) throw std::bad_alloc();
    return p;
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

int main() {
    fracslice::slices::Memory memory;
    fracslice::slices::Tiles first = memory.take(4), second = memory.take(4), third = memory.take(4);
    full = true;
    memory.give(std::move(first));
    memory.give(std::move(second));
    memory.give(std::move(third));
    full = false;
    return memory.take(4).count() == 2 ? 0 : 1;
}
