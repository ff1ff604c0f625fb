"""The formulas: one fractal per file, primitives, blends and warps. Importing this registers them all."""

from .blends import difference, intersection, shell, union
from .box import Box
from .confining import bounds, offset, repeat
from .deformations import bend, twist
from .julia import julia
from .mandelbulb import mandelbulb
from .material import material
from .menger import menger
from .primitives import box, capsule, cone, cylinder, octahedron, plane, sphere, torus
from .registry import Formula, Node, get, names
from .transforms import mirror, transform

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
    "material",
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
