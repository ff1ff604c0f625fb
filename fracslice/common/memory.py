"""Memory available on this machine, and memory used by this process."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path, PurePosixPath

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Parameters of glibc's ``mallopt``."""

KEPT, LARGEST = 32 << 20, 4 << 20
"""Freed bytes that stay with the process, and the largest block among them."""

KEPT_BY_TASKS, LARGEST_OF_TASKS = 512 << 20, 32 << 20
"""The same in a worker, whose tasks have large arrays, one after another; glibc allows no larger block."""

MAXRSS = 1 << 20 if sys.platform == "darwin" else 1 << 10
"""Units of ``ru_maxrss`` per MiB."""

OF_FIRST_VERSION = "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
"""Names of limit, use and cached pages in a control group of version 1."""


@cache
def keep_freed_memory() -> None:
    """Let glibc reuse freed memory instead of returning it to the system at once.

    Laying pages anew takes an eighth of the CPU time of a mesh. Other C libraries are left as they are.
    """
    _tell_glibc({M_TRIM_THRESHOLD: KEPT, M_MMAP_THRESHOLD: LARGEST})


@cache
def keep_memory_of_tasks() -> None:
    """Let glibc reuse the memory of a task for the next one."""
    _tell_glibc({M_TRIM_THRESHOLD: KEPT_BY_TASKS, M_MMAP_THRESHOLD: LARGEST_OF_TASKS})


def return_freed_memory() -> None:
    """Let glibc return freed memory of all threads to the system."""
    if sys.platform != "linux":
        return
    import ctypes

    if hasattr(library := ctypes.CDLL(None), "malloc_trim"):
        library.malloc_trim(0)


def _tell_glibc(values: dict[int, int]) -> None:
    if sys.platform != "linux":
        return
    import ctypes

    library = ctypes.CDLL(None)
    if not hasattr(library, "mallopt"):
        return
    if any(_left_of_limits()):  # each arena of a thread takes 64 MiB of addresses, used or not
        values |= {M_ARENA_MAX: 1}
    for parameter, value in values.items():
        library.mallopt(parameter, value)


def peak_rss_mb() -> float:
    """Return the peak resident set size of this process."""
    if peak := own_peak_mb(os.getpid()):
        return peak
    try:
        import resource
    except ImportError:
        return 0.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MAXRSS


def own_peak_mb(process: int) -> float:
    """Return the peak resident set size of a running process, as Linux has it.

    The maximum of ``getrusage`` begins with the memory of the process that started it.
    """
    with suppress(OSError), open(f"/proc/{process}/status") as status:
        return next((int(line.split()[1]) / 1024 for line in status if line.startswith("VmHWM:")), 0.0)
    return 0.0


def available_bytes() -> int:
    """Return the memory that this process can still allocate.

    Returns free memory in bytes.
    """
    free = sys.maxsize
    if hasattr(os, "sysconf"):
        free = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    for line in _lines("/proc/meminfo"):
        if line.startswith("MemAvailable:"):
            free = int(line.split()[1]) << 10
    return max(min(free, *_left_in_groups(), *_left_of_limits()), 0)


def _left_in_groups() -> Iterator[int]:
    """Bytes that are left in each control group of this process, and in those that these are in.

    In a container without a view of its path, the files of its group are at the root.
    """
    for line in _lines("/proc/self/cgroup"):
        _, controllers, path = line.split(":", 2)
        if not controllers:
            root, names = "/sys/fs/cgroup", ("memory.max", "memory.current", "inactive_file")
        elif "memory" in controllers.split(","):
            root, names = "/sys/fs/cgroup/memory", OF_FIRST_VERSION
        else:
            continue
        group = PurePosixPath(path)
        for place in (group, *group.parents):
            yield from _left_in_group(f"{root}{place}", *names)


def _left_in_group(folder: str, limit: str, used: str, cached: str) -> Iterator[int]:
    """Limit less use of one group; pages of files that nobody uses are given back on demand."""
    numbers = [line.strip() for name in (limit, used) for line in _lines(f"{folder}/{name}")]
    if len(numbers) == 2 and all(map(str.isdigit, numbers)):
        counts = dict(line.split() for line in _lines(f"{folder}/memory.stat"))
        yield int(numbers[0]) - int(numbers[1]) + int(counts.get(cached, 0))


def _left_of_limits() -> Iterator[int]:
    """Bytes that are left of this process's limits of addresses and of data, where Linux counts them."""
    try:
        import resource
    except ImportError:
        return
    for line in _lines("/proc/self/statm"):
        pages = [int(number) for number in line.split()]
        for kind, used in ((resource.RLIMIT_AS, pages[0]), (resource.RLIMIT_DATA, pages[5])):
            limit, _ = resource.getrlimit(kind)
            if limit != resource.RLIM_INFINITY:
                yield limit - used * resource.getpagesize()


def _lines(path: str) -> list[str]:
    try:
        return Path(path).read_text(encoding="ascii").splitlines()
    except OSError:
        return []
