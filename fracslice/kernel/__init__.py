"""A scene's distance field as something that can be called: the NumPy reference and the CPU's SIMD lanes."""

from .cpu import Compilable, CpuKernel, Kernel, compile_scene
from .identity import field_key
from .linker import Linked, link
from .reference import reference

__all__ = ["Compilable", "CpuKernel", "Kernel", "Linked", "compile_scene", "field_key", "link", "reference"]
