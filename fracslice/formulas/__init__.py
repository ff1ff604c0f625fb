"""The formulas: fractals, primitives, CSG and domain operators. Importing this registers them all."""

from .box import Box
from .confining import bounds, offset, repeat
from .csg import difference, intersection, shell, union
from .deformations import bend, twist
from .julia import julia
from .mandelbulb import mandelbulb
from .material import material
from .menger import menger
from .parameters import Axis, Choice, Count, Number, Vector
from .primitives import box, capsule, cone, cylinder, octahedron, plane, sphere, torus
from .registry import Fixed, Formula, Node, csg_operator, domain_operator, get, names, shape
from .transforms import mirror, transform
from .vocabulary import (
    absolute,
    any_of,
    atan2,
    cos,
    exp,
    floor,
    log,
    maximum,
    minimum,
    ratio,
    rsqrt,
    sin,
    sqrt,
    where,
)

__all__ = [
    "Axis",
    "Box",
    "Choice",
    "Count",
    "Fixed",
    "Formula",
    "Node",
    "Number",
    "Vector",
    "absolute",
    "any_of",
    "atan2",
    "bend",
    "bounds",
    "box",
    "capsule",
    "cone",
    "cos",
    "csg_operator",
    "cylinder",
    "difference",
    "domain_operator",
    "exp",
    "floor",
    "get",
    "intersection",
    "julia",
    "log",
    "mandelbulb",
    "material",
    "maximum",
    "menger",
    "minimum",
    "mirror",
    "names",
    "octahedron",
    "offset",
    "plane",
    "ratio",
    "repeat",
    "rsqrt",
    "shape",
    "shell",
    "sin",
    "sphere",
    "sqrt",
    "torus",
    "transform",
    "twist",
    "union",
    "where",
]
