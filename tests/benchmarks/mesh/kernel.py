"""Evaluations per second: the lanes against the same linked scene as scalar code, one core, one run.

`python -m tests.benchmarks.mesh.kernel [N]`: the grid of N^3 points (64) in the scene's box.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from types import FunctionType

import numpy as np
from numba import njit

from fracslice.formulas import Node, julia, mandelbulb, menger
from fracslice.kernel import compile_scene, link

SCENES = {
    "mandelbulb": mandelbulb(iterations=10),
    "julia": julia(iterations=12),
    "menger": menger(level=4),
}


def scalar_words() -> dict[str, Callable[..., float]]:
    """The vocabulary for one point at a time, with Numba's fast mathematics."""
    words: dict[str, Callable[..., float]] = {
        "where": lambda mask, a, b: a if mask else b,
        "any_of": lambda mask: mask,
        "sqrt": math.sqrt,
        "rsqrt": lambda a: 1.0 / math.sqrt(a),
        "ratio": lambda a, b: a / b,
        "log": math.log,
        "floor": math.floor,
        "minimum": lambda a, b: a if a < b else b,
        "maximum": lambda a, b: a if a > b else b,
        "absolute": math.fabs,
    }
    return {name: njit(inline="always")(f) if isinstance(f, FunctionType) else f for name, f in words.items()}


def scalar_kernel(root: Node) -> Callable[..., None]:
    """``run(P, x, y, z, out)``, the linked scene in a plain loop."""
    scope: dict[str, object] = dict(scalar_words())
    exec(compile(link(root).source, "<scalar>", "exec"), scope)
    for name, value in list(scope.items()):
        if isinstance(value, FunctionType):
            scope[name] = njit(
                inline="always", error_model="numpy", fastmath={"contract", "arcp", "afn", "nsz"}
            )(value)
    source = (
        "def run(P, x, y, z, out):\n    for i in range(len(x)):\n        out[i] = field(x[i], y[i], z[i], P)"
    )
    exec(source, scope)
    return njit(error_model="numpy")(scope["run"])


def rate(run: Callable[[], object], count: int) -> float:
    """Million evaluations per second of CPU time, the median of five."""
    run()
    times = []
    for _ in range(5):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return count / sorted(times)[2] / 1e6


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    print(f"{'million evaluations/s, one core':34}{'lanes':>9}{'scalar':>9}{'ratio':>8}")
    for name, root in SCENES.items():
        half = max(root.facts.box.hi)
        axis = np.linspace(-half, half, n, dtype=np.float32)
        x, y, z = (a.ravel() for a in np.meshgrid(axis, axis, axis, indexing="ij"))
        kernel, scalar = compile_scene(root), scalar_kernel(root)
        parameters, out = link(root).parameters.astype(np.float32), np.empty(x.size, np.float32)
        fast = rate(lambda k=kernel, p=(x, y, z): k.points(*p), x.size)
        slow = rate(lambda s=scalar, a=(parameters, x, y, z, out): s(*a), x.size)
        print(f"{name + ' float32':34}{fast:9.1f}{slow:9.1f}{fast / slow:7.1f}x")


if __name__ == "__main__":
    main()
