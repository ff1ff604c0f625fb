"""How much memory there is, and how much a job takes."""

from __future__ import annotations

import os
from pathlib import Path


def peak_rss_mb() -> float:
    """The most memory this process has used so far, in MB."""
    import resource
    import sys

    unit = 1 << 20 if sys.platform == "darwin" else 1 << 10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def available_bytes() -> int:
    """The memory that can still be had: what is free, within the limits set on this process's group."""
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
