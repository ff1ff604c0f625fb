"""The processor that kernels are compiled for."""

from __future__ import annotations

from functools import lru_cache

REGISTERS = 2
"""How many are in flight at once, which hides the latency of the arithmetic."""


def lane_count(bits: int) -> int:
    """How many points of this float width are evaluated at once."""
    register = 512 if "+avx512f" in host()[1].split(",") else 256
    return REGISTERS * register // bits


@lru_cache(maxsize=1)
def host() -> tuple[str, str]:
    """The CPU's name and features, as LLVM spells them."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
