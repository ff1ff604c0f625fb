// Long calls let other Python threads run.
#pragma once
#include <nanobind/nanobind.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace fracslice {

// Runs without the interpreter's lock, on a number of threads (0: all cores), at most one per core: TBB prints a warning about
// more.
template <class Do>
auto unlocked(int threads, const Do& act) {
    nanobind::gil_scoped_release released;
    const int cores = tbb::info::default_concurrency();
    tbb::task_arena arena(threads > 0 ? std::min(threads, cores) : cores);
    return arena.execute(act);
}

}  // namespace fracslice
