"""A scene's distance field as something that can be called: the NumPy reference and the CPU's SIMD lanes."""

from ..formulas.field import Field, Kernel
from .cpu import CpuKernel, compile_scene
from .linker import Linked, link
from .reference import reference

__all__ = ["CpuKernel", "Field", "Kernel", "Linked", "compile_scene", "link", "reference"]
