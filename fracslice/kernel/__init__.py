"""Compiled kernels of a scene's distance field: the NumPy reference and SIMD lanes of the CPU."""

from ..formulas.field import Field, Kernel
from .cpu import CpuKernel, compile_scene
from .linker import Linked, link
from .reference import reference

__all__ = ["CpuKernel", "Field", "Kernel", "Linked", "compile_scene", "link", "reference"]
