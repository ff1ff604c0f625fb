"""Host CPU that kernels are compiled for."""

from __future__ import annotations

from functools import lru_cache

REGISTERS = 2
"""Vector registers per value: independent instructions in flight hide the latency of the arithmetic."""


def lane_count(bits: int) -> int:
    """Return the number of points evaluated at once.

    Parameters
    ----------
    bits
        Width of a float: 32 or 64.

    Returns
    -------
    int
        Lanes.
    """
    register = 512 if "+avx512f" in host()[1].split(",") else 256
    return REGISTERS * register // bits


@lru_cache(maxsize=1)
def host() -> tuple[str, str]:
    """Return the host CPU as LLVM spells it.

    Returns
    -------
    tuple of str
        Name and features.
    """
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
