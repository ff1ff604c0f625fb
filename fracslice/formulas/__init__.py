"""The formulas: one fractal per file, primitives, blends and warps. Importing this registers them all."""

from .blends import difference, intersection, offset, shell, union
from .box import Box
from .julia import julia
from .mandelbulb import mandelbulb
from .menger import menger
from .primitives import box, capsule, cone, cylinder, octahedron, plane, sphere, torus
from .registry import Formula, Node, get, names
from .warps import bend, bounds, mirror, repeat, transform, twist

__all__ = [
    "Box",
    "Formula",
    "Node",
    "bend",
    "bounds",
    "box",
    "capsule",
    "cone",
    "cylinder",
    "difference",
    "get",
    "intersection",
    "julia",
    "mandelbulb",
    "menger",
    "mirror",
    "names",
    "octahedron",
    "offset",
    "plane",
    "repeat",
    "shell",
    "sphere",
    "torus",
    "transform",
    "twist",
    "union",
]
