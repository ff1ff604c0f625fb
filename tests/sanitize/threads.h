// Included first in every file of a build with the thread sanitizer: TBB's algorithms run on plain threads, for the sanitizer
// does not see what the library of TBB, which is built without it, synchronises. Every thread gets some of the tasks, and none
// waits for another: a race between two tasks is seen whatever the order they run in.
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace tbb::plain {

inline thread_local int concurrency = 4;

// Calls task(k) for 0 <= k < n, in turn on each of some threads; rethrows the first exception. Within a task: on its thread.
template <class Task>
void run(size_t n, const Task& task) {
    const size_t threads = std::min(n, size_t(std::max(concurrency, 1)));
    if (threads < 2) {
        for (size_t k = 0; k < n; ++k) task(k);
        return;
    }
    std::exception_ptr failure;
    std::mutex failing;
    auto work = [&](size_t first) {
        concurrency = 1;
        try {
            for (size_t k = first; k < n; k += threads) task(k);
        } catch (...) {
            std::lock_guard lock(failing);
            if (!failure) failure = std::current_exception();
        }
    };
    std::vector<std::thread> all;
    for (size_t i = 0; i < threads; ++i) all.emplace_back(work, i);
    for (std::thread& thread : all) thread.join();
    if (failure) std::rethrow_exception(failure);
}

// A range in 2^halvings pieces, or fewer where it cannot be cut.
template <class Range>
void cut(const Range& range, int halvings, std::deque<Range>& pieces) {
    if (!halvings || !range.is_divisible()) {
        pieces.push_back(range);
        return;
    }
    Range first = range, second(first, tbb::split());
    cut(first, halvings - 1, pieces), cut(second, halvings - 1, pieces);
}
template <class Range>
std::deque<Range> pieces(const Range& range) {
    std::deque<Range> all;
    cut(range, 6, all);
    return all;
}

template <class Index, class Body>
    requires std::is_integral_v<Index>
void parallel_for(Index first, Index last, const Body& body) {
    run(first < last ? size_t(last - first) : 0, [&](size_t k) { body(Index(first + Index(k))); });
}

template <class Range, class Body, class... Partitioner>
    requires(!std::is_integral_v<Range>)
void parallel_for(const Range& range, const Body& body, Partitioner&&...) {
    std::deque<Range> all = pieces(range);
    run(all.size(), [&](size_t k) { body(all[k]); });
}

template <class Range, class Value, class Body, class Join>
Value parallel_reduce(const Range& range, const Value& identity, const Body& body, const Join& join) {
    std::deque<Range> all = pieces(range);
    std::vector<Value> values(all.size(), identity);
    run(all.size(), [&](size_t k) { values[k] = body(all[k], identity); });
    Value total = identity;
    for (const Value& value : values) total = join(total, value);
    return total;
}

// Bodies that hold their result.
template <class Range, class Body, class... Partitioner>
void parallel_reduce(const Range& range, Body& body, Partitioner&&...) {
    for (Range& piece : pieces(range)) body(piece);
}

struct task_arena {
    static constexpr int automatic = 4;
    explicit task_arena(int threads = automatic) : threads_(threads) {}
    template <class Act>
    auto execute(const Act& act) {
        struct Within {
            explicit Within(int threads) { std::swap(concurrency, threads), before = threads; }
            ~Within() { concurrency = before; }
            int before;
        } within(threads_);
        return act();
    }

  private:
    int threads_;
};

}  // namespace tbb::plain

namespace tbb::info {

inline int plain_concurrency() { return 16; }  // races show on any number of cores

}  // namespace tbb::info

#define default_concurrency plain_concurrency
#define parallel_for plain::parallel_for
#define parallel_reduce plain::parallel_reduce
#define task_arena plain::task_arena
