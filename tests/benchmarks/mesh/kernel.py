"""Evaluations per second on one core, in one run: the lanes, the same linked scene as scalar code, and
hand-written C++ on the same points.

`python -m tests.benchmarks.mesh.kernel [N]`: the centres of N^3 cells (64) of a cube around the scene, then
those of them that are nearer to the surface than four cells ("band"). Ours carries a sign, a bound and the
inside's level; the C++ returns 0 there.
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
from fracslice.kernel.linker import CALLED

from ..programs import told
from ..tables import table

SCENES = {
    "mandelbulb": mandelbulb(iterations=10),
    "julia": julia(iterations=12),
    "menger": menger(level=4),
}
WORKS = {"mandelbulb": ("W1", 1.2), "julia": ("W2", 1.5), "menger": ("W3", 1.2)}
"""The peer's name for it, and half the side of its cube."""

BAND = 4


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
    scope: dict[str, object] = {**scalar_words(), CALLED: lambda function: function}
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


def points(root: Node, half: float, n: int) -> dict[str, np.ndarray]:
    """The cells' centres [3, m] by the name of their set."""
    h = 2 * half / n
    axis = -half + (np.arange(n) + 0.5) * h
    grid = np.stack([a.ravel() for a in np.meshgrid(axis, axis, axis, indexing="ij")])
    near = np.abs(compile_scene(root, "float64").points(*grid)) < BAND * h
    return {"grid": grid, "band": grid[:, near]}


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    lines = [line for line in told("kernels", n) if "form" in line]
    peers: dict[tuple[str, ...], float] = {}
    for line in lines:
        key = line["workload"], line["form"].split("_")[-1], line["points"]
        peers[key] = max(peers.get(key, 0.0), line["million_per_s"])
    rows = []
    for name, root in SCENES.items():
        work, half = WORKS[name]
        scalar, parameters = scalar_kernel(root), link(root).parameters
        for which, centres in points(root, half, n).items():
            for precision in ("float32", "float64"):
                at, kernel = centres.astype(precision), compile_scene(root, precision)
                fast = rate(lambda k=kernel, p=at: k.points(*p), at.shape[1])
                told_of, peer = "", peers[work, precision, which]
                if precision == "float32":
                    out, given = np.empty(at.shape[1], np.float32), parameters.astype(np.float32)
                    slow = rate(lambda s=scalar, a=(given, *at, out): s(*a), at.shape[1])
                    told_of = f"{fast / slow:.1f}"
                rows.append(
                    (name, precision, which, f"{fast:.0f}", told_of, f"{peer:.0f}", f"{fast / peer:.2f}")
                )
    head = ("", "", "points", "million/s", "/ scalar Numba", "C++, million/s", "/ C++")
    print(table(head, rows))


if __name__ == "__main__":
    main()
