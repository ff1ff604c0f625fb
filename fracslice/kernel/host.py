"""Host CPU that kernels are compiled for, and the compiler."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

import llvmlite

from ..common.cache_files import Kept, cache_folder
from ..common.keys import key, texts
from ..formulas import vocabulary

REGISTERS = 2
"""Vector registers per value: independent instructions in flight hide the latency of the arithmetic."""

PROCESSORS = Path("/proc/cpuinfo")
MOST = 1 << 14
"""Characters that the first processor takes at most."""
DESCRIBED = {"vendor_id", "cpu family", "model", "model name", "stepping", "flags"}
"""Lines of a processor in the file, from which LLVM's name and features follow."""


def lane_count(bits: int) -> int:
    """Return the number of points evaluated at once.

    Parameters
    ----------
    bits
        Width of a float: 32 or 64.
    """
    register = 512 if "+avx512f" in host()[1].split(",") else 256
    return REGISTERS * register // bits


def host() -> tuple[str, str]:
    """Return the host CPU as LLVM spells it.

    Returns
    -------
    tuple of str
        Name and features.
    """
    name, features, _ = description()
    return name, features


@lru_cache(maxsize=1)
def description() -> tuple[str, str, str]:
    """Return the host CPU and the version of LLVM: cached for this processor, or asked of LLVM.

    Returns
    -------
    tuple of str
        Name, features and version.
    """
    processor = _processor()
    if not processor:
        return _asked()
    library = os.stat(llvmlite.__file__)
    about = key(processor, llvmlite.__version__, llvmlite.__file__, library.st_mtime_ns)
    kept = Kept(cache_folder() / "hosts")
    text = kept.cached(f"{about}.txt", lambda: "\n".join(_asked()).encode()).decode()
    name, features, version = text.split("\n")
    return name, features, version


@lru_cache(maxsize=1)
def toolchain() -> str:
    """Return the key of everything that machine code depends on besides the linked text."""
    own = texts(*sorted(Path(__file__).parent.glob("*.py")), Path(vocabulary.__file__))
    return key(own, description(), llvmlite.__version__)


def _asked() -> tuple[str, str, str]:
    """Ask LLVM; loading its library takes a tenth of a small job."""
    import llvmlite.binding as llvm

    version = ".".join(map(str, llvm.llvm_version_info))
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten(), version


def _processor() -> str:
    """Lines of Linux that describe an x86 processor; empty on any other system."""
    try:
        with PROCESSORS.open(encoding="ascii", errors="replace") as file:
            first = file.read(MOST).split("\n\n", 1)[0]  # of hundreds of processors
    except OSError:
        return ""
    lines = [line for line in first.splitlines() if line.split("\t")[0].rstrip() in DESCRIBED]
    return "\n".join(lines) if len(lines) == len(DESCRIBED) else ""
