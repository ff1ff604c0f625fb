"""Host CPU that kernels are compiled for, the compiler, and texts kept in the cache of kernels."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import llvmlite

from ..common.cache import PACKAGE, Kept, cache_folder, key, texts

REGISTERS = 2
"""Vector registers per value: independent instructions in flight hide the latency of the arithmetic."""

PROCESSORS = Path("/proc/cpuinfo")
MOST = 1 << 14
"""Characters that the first processor takes at most."""
DESCRIBED = {"vendor_id", "cpu family", "model", "model name", "stepping", "flags"}
"""Lines of a processor in the file, from which LLVM's name and features follow."""

TRANSLATORS = "expr", "fields"
"""Packages that make texts of formulas and scenes, and code of these; it is kept under their own text."""


def lane_count(bits: int) -> int:
    """Return the number of points evaluated at once."""
    register = 512 if "+avx512f" in host()[1].split(",") else 256
    return REGISTERS * register // bits


def host() -> tuple[str, str]:
    """Return the host CPU as LLVM spells it."""
    name, features, _ = description()
    return name, features


@lru_cache(maxsize=1)
def description() -> tuple[str, str, str]:
    """Return the host CPU and the version of LLVM: cached for this processor, or asked of LLVM."""
    processor = _processor()
    if not processor:
        return _ask_llvm()
    library = os.stat(llvmlite.__file__)
    about = key(processor, llvmlite.__version__, llvmlite.__file__, library.st_mtime_ns)
    kept = Kept(cache_folder() / "hosts")
    text = kept.cached(f"{about}.txt", lambda: "\n".join(_ask_llvm()).encode()).decode()
    name, features, version = text.split("\n")
    return name, features, version


@lru_cache(maxsize=1)
def toolchain() -> str:
    """Return the key of everything that machine code depends on besides the functions."""
    own = texts(*(path for name in TRANSLATORS for path in sorted((PACKAGE / name).glob("*.py"))))
    return key(own, description(), llvmlite.__version__)


def _ask_llvm() -> tuple[str, str, str]:
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


def kept_text(kind: str, made_of: tuple[object, ...], make: Callable[[], str]) -> str:
    """Return a text: cached, or made and cached.

    A file that other users could have written is not used.
    """
    kept, name = _place(kind, made_of)
    return kept.cached(name, lambda: make().encode()).decode()


def keep_text(kind: str, made_of: tuple[object, ...], text: str) -> None:
    """Replace a cached text; see `kept_text`."""
    kept, name = _place(kind, made_of)
    kept.put_checked(name, text.encode())


def _place(kind: str, made_of: tuple[object, ...]) -> tuple[Kept, str]:
    return Kept(cache_folder() / kind), f"{key(kind, *made_of, toolchain())}.txt"
