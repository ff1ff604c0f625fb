"""A scene's distance field as something that can be called: the NumPy reference and the CPU's SIMD lanes."""

from .cpu import Compilable, CpuKernel, Kernel, compile_scene
from .linker import Linked, link
from .reference import reference

__all__ = ["Compilable", "CpuKernel", "Kernel", "Linked", "compile_scene", "link", "reference"]
