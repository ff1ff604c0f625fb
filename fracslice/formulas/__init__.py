"""The formulas: fractals, primitives, CSG and domain operators. Importing this package registers them all."""

from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from ..common.parameters import Axis as Axis
from ..common.parameters import Choice as Choice
from ..common.parameters import Count as Count
from ..common.parameters import Number as Number
from ..common.parameters import Vector as Vector
from .box import Box as Box
from .orbits import orbit as orbit
from .registry import Fixed as Fixed
from .registry import Formula as Formula
from .registry import Node as Node
from .registry import csg_operator as csg_operator
from .registry import domain_operator as domain_operator
from .registry import get as get
from .registry import names as names
from .registry import shape as shape
from .vocabulary import *  # noqa: F403

for _module in iter_modules([str(Path(__file__).parent)]):
    import_module(f".{_module.name}", __name__)
globals().update({name: get(name) for name in names()})
