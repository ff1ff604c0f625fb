"""Run by test_cuda.py in a process of its own, on Numba's CUDA simulator, and fails as a test does."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fracslice.fields import cuda
from fracslice.fields.node import FORMULAS
from fracslice.fields.reference import reference
from fracslice.mesh.roots import LOOPS, Roots
from tests.examples import DEFINED, EXAMPLES, OF_FILES
from tests.kernel.idioms import HEAD, SAME, P, imported

TOLERANCE = {"float32": 2e-5, "float64": 1e-13}


def main() -> None:
    assert cuda.available()
    with np.errstate(all="ignore"):
        known = EXAMPLES | DEFINED
        known = {name: node for name, node in known.items() if name not in OF_FILES}  # no GPU computes it
        for name in sys.argv[1:] or known:
            for precision in ("float32", "float64"):
                points(name, cuda.compile_scene(known[name], precision), reference(known[name]))
        idioms()
        bricks()
        roots()


def points(name: str, kernel: cuda.CudaKernel, expected: Callable[..., np.ndarray]) -> None:
    p = np.random.default_rng(3).uniform(-1.6, 1.6, (3, 4)).astype(kernel.dtype)
    p[:2, 0] = 0.0
    got, tolerance = kernel.points(*p), TOLERANCE[kernel.dtype.name]
    assert got.dtype == kernel.dtype
    np.testing.assert_allclose(got, expected(*p), rtol=tolerance, atol=tolerance, err_msg=name)
    assert np.isnan(kernel.points(*np.array([(np.nan, 0, 0), (0, np.nan, 0), (0, 0, np.nan)]).T)).all(), name


def idioms() -> None:
    """What formulas may say means the same in the CUDA text."""
    known = dict(FORMULAS)
    with tempfile.TemporaryDirectory() as folder:
        for number, (body, expected) in enumerate(SAME.items()):
            root = imported(f"{HEAD}    {body}", Path(folder), f"idiom{number}").mine(radius=0.7)
            got = cuda.compile_scene(root, "float64").points(*P[:, :4])
            np.testing.assert_allclose(got, expected[:4], rtol=1e-12, atol=1e-12, err_msg=body)
            FORMULAS.clear()
            FORMULAS.update(known)


def bricks() -> None:
    """Each sample of each brick is the value at its own point; arrays may have any shape or be empty."""
    kernel = cuda.compile_scene(EXAMPLES["capsule"])
    corners, out = np.array([(0, 0, 0), (8, 0, 16), (16, 8, 8)], np.int32), np.empty((3, 512), np.float32)
    kernel.bricks(corners, (-1.5, -1.25, -1.375), 0.125, out)
    index = corners[:, None] + np.indices((8, 8, 8)).reshape(3, -1).T
    alone = kernel.points(*np.moveaxis(np.array([-1.5, -1.25, -1.375]) + 0.125 * index, -1, 0))
    assert (alone == out).all()
    assert kernel.points(*np.empty((3, 0))).shape == (0,)
    kernel.bricks(corners[:0], (0, 0, 0), 1.0, out[:0])


def ran(finder: Roots, name: str, rows: np.ndarray, count: int) -> np.ndarray:
    """Rows that a loop writes."""
    out = np.empty((count, rows.shape[1]), finder.dtype)
    finder.runs[name](finder.frame, rows, out)
    return out


def roots() -> None:
    """Loops over lanes, with a thread per lane, find the roots and normals of the lanes."""
    root = EXAMPLES["mandelbulb"]
    width = Roots(root, "float32", 0.02).width
    directions = np.random.default_rng(5).normal(size=(3, width))
    directions /= np.linalg.norm(directions, axis=0)
    segments = np.concatenate([0.1 * directions, 2.0 * directions])
    for precision, tolerance in (("float32", 1e-4), ("float64", 1e-9)):
        rows = segments.astype(precision)
        lanes, threads = (Roots(root, precision, 0.02, device) for device in ("cpu", "cuda"))
        expected, computed = (ran(finder, "find", rows, 1)[0] for finder in (lanes, threads))
        assert ((expected > 0) & (expected < 1)).all()
        np.testing.assert_allclose(computed, expected, atol=tolerance)
    polished = [np.tile(expected, (5, 1)) for _ in range(2)]
    for out, device in zip(polished, ("cpu", "cuda"), strict=True):
        root.loops(LOOPS["float64"], "float64", device).runs["polish"](lanes.frame, rows, out)
    np.testing.assert_allclose(*polished, atol=1e-5)
    regions = np.full((15, width), np.nan)
    regions[:3], regions[3:9] = directions, 0.1
    finders = (Roots(root, "float32", 0.02, device) for device in ("cpu", "cuda"))
    guesses = [ran(finder, "lead", regions.astype(np.float32), 3) for finder in finders]
    np.testing.assert_allclose(*guesses, atol=1e-3)


if __name__ == "__main__":
    main()
