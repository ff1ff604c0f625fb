"""Every example on a real GPU against the NumPy reference: the worst error as a share of what is allowed.

Random points, poles and axes, denormals, far points, NaN and infinity, bricks against points.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fracslice.fields import cuda
from fracslice.fields.devices import reference
from fracslice.formulas import Node
from tests.examples import EXAMPLES

from ..runner import Row, Run

TOLERANCE = {"float32": 2e-5, "float64": 1e-13}
ORIGIN, VOXEL = (-1.5, -1.25, -1.375), 0.125


def share(got: np.ndarray, expected: np.ndarray, absolute: float, relative: float) -> float:
    """The largest error over what is allowed; infinite where only one of two values is NaN."""
    error = np.abs(got - expected) / (absolute + relative * np.abs(expected))
    return float(np.max(np.where(np.isnan(got) != np.isnan(expected), np.inf, np.nan_to_num(error))))


def checks(root: Node, precision: str) -> Iterator[tuple[str, float]]:
    """The name of each check, and its error as a share of the allowed."""
    kernel, expected = cuda.compile_scene(root, precision), reference(root)  # type: ignore[arg-type]
    small = TOLERANCE[precision]
    points = np.random.default_rng(5).uniform(-1.6, 1.6, (3, 200_000)).astype(precision)
    yield "random", share(kernel.points(*points), expected(*points), small, small)
    points = poles(precision)
    yield "poles", share(kernel.points(*points), expected(*points), 10 * small, 1e-3)
    tiny, zero = np.full((3, 1), 1e-42 if precision == "float32" else 5e-324), np.zeros((3, 1))
    yield "denormal", share(kernel.points(*tiny), kernel.points(*zero), 1e-6, 0.0)
    far = np.random.default_rng(1).normal(size=(3, 64)) * np.logspace(1, 18, 64)
    yield "far", holds(kernel.points(*far) > 0, expected(*far) > 0)
    bad = np.array([(np.nan, 0, 0), (0, np.nan, 0), (0, 0, np.nan), (np.nan,) * 3]).T
    yield "NaN", holds(np.isnan(kernel.points(*bad)), True)
    if root.bounds.box.finite:
        endless = np.array([(np.inf, 0, 0), (0, -np.inf, 0), (0, 0, np.inf), (np.inf, np.inf, -np.inf)]).T
        yield "infinity", holds(kernel.points(*endless) < 0, False)
    yield "bricks", bricks(kernel)


def holds(values: np.ndarray, expected: np.ndarray | bool) -> float:
    return 0.0 if (values == expected).all() else np.inf


def poles(precision: str) -> np.ndarray:
    r = np.linspace(-1.5, 1.5, 31).astype(precision)
    o, tiny = np.zeros_like(r), np.full_like(r, 1e-7)
    return np.concatenate([[r, o, o], [o, r, o], [o, o, r], [tiny, o, r], [r, r, o], [o, o, o]], axis=1)


def bricks(kernel: cuda.CudaKernel) -> float:
    """Samples of bricks against the values at their points; the two need not fuse the same products."""
    corners = np.array([(0, 0, 0), (8, 0, 16), (16, 8, 8)], np.int32)
    out = np.empty((3, 512), kernel.dtype)
    kernel.bricks(corners, ORIGIN, VOXEL, out)
    index = corners[:, None] + np.indices((8, 8, 8)).reshape(3, -1).T
    small = TOLERANCE[kernel.dtype.name]
    return share(kernel.points(*np.moveaxis(ORIGIN + VOXEL * index, -1, 0)), out, small, small)


def rows(run: Run, names: tuple[str, ...] = tuple(EXAMPLES)) -> Iterator[Row]:
    for name in names:
        if any(node.is_in_memory for node in EXAMPLES[name].solids()):  # computed on the CPU
            continue
        for precision in TOLERANCE:
            with np.errstate(all="ignore"):
                result = dict(checks(EXAMPLES[name], precision))
            wrong = [
                f"{name}, {precision}, {check}: {share:.2g}"
                for check, share in result.items()
                if not share <= 1
            ]
            run.faults.extend(wrong)
            yield {
                "": name,
                "precision": precision,
                **{check: f"{share:.2g}" for check, share in result.items()},
            }
