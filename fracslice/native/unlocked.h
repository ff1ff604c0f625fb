// Long calls let other Python threads run.
#pragma once
#include <nanobind/nanobind.h>
#include <tbb/task_arena.h>

namespace fracslice {

// Runs without the interpreter's lock, on a number of threads (0: all cores).
template <class Do>
auto unlocked(int threads, const Do& act) {
    nanobind::gil_scoped_release released;
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    return arena.execute(act);
}

}  // namespace fracslice
