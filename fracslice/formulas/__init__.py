"""The formulas: fractals, primitives, CSG and domain operators. Importing this package registers them all."""

from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from ..common.parameters import Axis as Axis
from ..common.parameters import Choice as Choice
from ..common.parameters import Count as Count
from ..common.parameters import Number as Number
from ..common.parameters import Vector as Vector
from ..expr.vocabulary import *  # noqa: F403
from ..fields.box import Box as Box
from ..fields.orbits import orbit as orbit
from ..fields.registry import Fixed as Fixed
from ..fields.registry import Formula as Formula
from ..fields.registry import Node as Node
from ..fields.registry import csg_operator as csg_operator
from ..fields.registry import domain_operator as domain_operator
from ..fields.registry import get as get
from ..fields.registry import names as names
from ..fields.registry import shape as shape

for _module in iter_modules([str(Path(__file__).parent)]):
    import_module(f".{_module.name}", __name__)
globals().update({name: get(name) for name in names()})
