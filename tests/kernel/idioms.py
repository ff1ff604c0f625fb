"""Idioms of formulas, as users write them, for the tests of all back ends."""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path
from types import ModuleType

import numpy as np

HEAD = """\
import math
import numpy as np
from fracslice.formulas import Box, Number, csg_operator, domain_operator, shape
TURN = 0.5
POWER = 3
CORNERS = ((1.0, 0.5), (-0.5, 2.0))
SIZES = (0.5, 2.0, 4.0)
@shape(radius=Number(1.0, "the radius", above=0))
def mine(x, y, z, radius):
"""


def imported(text: str, folder: Path, name: str) -> ModuleType:
    """A text as a module of its own, with a file."""
    path = folder / f"{name}.py"
    path.write_text(text)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec and spec.loader
    sys.modules[name] = result = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(result)
    return result


P = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 200))
X, Y, Z = P

SAME = {
    "return abs(x) - radius": abs(X) - 0.7,
    "return min(x, y, z)": np.minimum(np.minimum(X, Y), Z),
    "return max(x, 0.25) - min(y, z)": np.maximum(X, 0.25) - np.minimum(Y, Z),
    "return math.sqrt(x ** 2 + pow(y - z, 4)) - radius": np.sqrt(X**2 + (Y - Z) ** 4) - 0.7,
    "return (x * x) ** 0.5 + np.abs(np.sin(y)) - math.pi": abs(X) + abs(np.sin(Y)) - math.pi,
    "f = x\n    f += TURN\n    f *= 2.0\n    return f": 2 * (X + 0.5),
    "return max(radius, 0.5) * x": 0.7 * X,
    "return x % 1.0 - (y * z) // radius": X % 1.0 - (Y * Z) // 0.7,
    "return where((x != y) & ~(x > z), y, z)": np.where(X > Z, Z, Y),
    "return where(-0.5 < x <= y, y, z)": np.where((X > -0.5) & (X <= Y), Y, Z),
    "f = 0.0\n    for k in range(3):\n        f += k * x\n    return f": 3 * X,
    "n = 0\n    for _ in range(3):\n        n += 1\n    return n * x": 3 * X,
    "f = 1.0\n    for s in (0.5, -2.0):\n        f = f * s + x\n    return f": (0.5 + X) * -2.0 + X,
    "f = x\n    for a, b in CORNERS:\n        f = max(f, a * y + b * z)\n    return f": np.maximum(
        np.maximum(X, Y + 0.5 * Z), -0.5 * Y + 2 * Z
    ),
    "a, b, c = SIZES\n    return a * x + b * y + c * z": 0.5 * X + 2 * Y + 4 * Z,
    "f = x\n    for k in range(3):\n        f = f + SIZES[k] * y\n    return f - SIZES[1]": X + 6.5 * Y - 2,
    "return x ** POWER - y ** 2.0": X**3 - Y**2,
    "x += TURN\n    y -= x\n    z *= y\n    return z / radius": Z * (Y - X - 0.5) / 0.7,
    "d = 0.0\n    for a in SIZES:\n        d += a * x ** 2\n    return d": 6.5 * X**2,
    "d, n = 0.0, 1\n    for a, b in CORNERS:\n        d += a * x\n        n *= 2\n    return d / n": 0.125
    * X,
    "x, y = y, -x\n    return x - (y if radius > 0.5 else z)": X + Y,
    "m = x > y\n    k = ~m | (z != 0.0)\n    return where(m & k, 1, 0) * z": np.where(X > Y, Z, 0),
    "x, y, z = abs(x), abs(y), -z\n    return -(x + y) + +z": -(abs(X) + abs(Y)) - Z,
}
"""Bodies of the formula `mine` of radius 0.7, and their values at `P`.

They have augmented assignments (also of arguments), powers, remainders, comparisons, masks, accumulators,
loops over tuples, and constants of the module and of `math`.
"""
