"""Memory available on this machine, and memory used by this process."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Parameters of glibc's ``mallopt``."""

KEPT, LARGEST = 32 << 20, 4 << 20
"""Freed bytes that stay with the process, and the largest block among them."""

KEPT_BY_TASKS, LARGEST_OF_TASKS = 512 << 20, 32 << 20
"""The same in a worker, whose tasks have large arrays, one after another; glibc allows no larger block."""

MAXRSS = 1 << 20 if sys.platform == "darwin" else 1 << 10
"""Units of ``ru_maxrss`` per MiB."""


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


def _tell_glibc(values: dict[int, int]) -> None:
    if sys.platform != "linux":
        return
    import ctypes

    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):
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
    for limit, used in (
        ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ):
        numbers = [line.strip() for line in (*_lines(limit), *_lines(used))]
        if len(numbers) == 2 and all(map(str.isdigit, numbers)):
            free = min(free, max(int(numbers[0]) - int(numbers[1]), 0))
    return free


def _lines(path: str) -> list[str]:
    try:
        return Path(path).read_text(encoding="ascii").splitlines()
    except OSError:
        return []
