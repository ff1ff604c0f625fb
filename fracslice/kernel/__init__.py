"""A scene's distance field as something that can be called: the NumPy reference and the CPU's SIMD lanes."""

from .cpu import CpuKernel, Compilable, Kernel, compile_scene
from .linker import Linked, link
from .reference import reference

__all__ = ["CpuKernel", "Compilable", "Kernel", "Linked", "compile_scene", "link", "reference"]
