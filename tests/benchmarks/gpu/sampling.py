"""Sampling of bricks on a real GPU: the kernel against nvcc on the same arithmetic, and the whole sampler.

The kernel runs on arrays of the GPU; the sampler has its results in the computer's memory.
"""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from fracslice.expr import cuda_driver
from fracslice.fields import cpu, cuda
from fracslice.fields.linker import link
from fracslice.formulas import Node, mandelbulb, menger
from fracslice.volume import Lattice, sample

from ..runner import Row, Run
from . import native

SCENES: dict[str, Node] = {"mandelbulb": mandelbulb(iterations=8), "menger": menger(level=5)}
SIZE, HALF = 512, 1.2
ORIGIN, VOXEL = (-HALF, -HALF, -HALF), 2 * HALF / SIZE
LATTICE = Lattice(ORIGIN, VOXEL, (SIZE // 8,) * 3)


def dense() -> np.ndarray:
    """The corners of all bricks of a cube of SIZE^3 samples."""
    return np.ascontiguousarray(8 * np.indices((SIZE // 8,) * 3).reshape(3, -1).T, np.int32)


def surface(root: Node) -> np.ndarray:
    """The corners of the bricks that the surface passes through, in that cube."""
    return sample(cuda.compile_scene(root), root.bounds, LATTICE).ijk  # type: ignore[arg-type]


def best(run: Callable[[], None], rounds: int = 10) -> float:
    """The shortest of a few times on the GPU, ms; it is kept busy before, so that launching costs nothing."""
    times, took = [], ctypes.c_float()
    start, end = ctypes.c_void_p(), ctypes.c_void_p()
    for event in (start, end):
        cuda_driver.call("cuEventCreate", ctypes.byref(event), 0)
    for _ in range(rounds):
        run()
        cuda_driver.call("cuEventRecord", start, None)
        run()
        cuda_driver.call("cuEventRecord", end, None)
        cuda_driver.call("cuEventSynchronize", end)
        cuda_driver.call("cuEventElapsedTime", ctypes.byref(took), start, end)
        times.append(took.value)
    return min(times)


def rates(root: Node, corners: np.ndarray) -> dict[str, tuple[float, int]]:
    """By back end: G evaluations/s, and how many samples are inside."""
    kernel = cuda.compile_scene(root)
    count, placed = 512 * len(corners), cuda_driver.to_device(corners)
    out = cuda_driver.device_array((len(corners), 512), np.float32)
    took = best(lambda: kernel.bricks_on_device(placed, ORIGIN, VOXEL, out))
    measured = {"fracslice": (count / took / 1e6, int((out.copy_to_host() < 0).sum()))}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "corners"
        corners.tofile(path)
        for name, flags in native.FLAGS.items():
            took, inside, error = native.run(
                link(root), native.SAMPLING, flags, str(path), *(str(v) for v in (*ORIGIN, VOXEL))
            )
            assert error == 0
            measured[name] = (count / took / 1e6, int(inside))
    return measured


def rows(run: Run, scenes: tuple[str, ...] = tuple(SCENES)) -> Iterator[Row]:
    for name in scenes:
        root = SCENES[name]
        for part, corners in {"dense": dense(), "surface": surface(root)}.items():
            for back_end, (rate, inside) in rates(root, corners).items():
                yield {"": name, "samples": part, "by": back_end, "G evaluations/s": rate, "inside": inside}
        kernels = {"CPU": cpu.compile_scene(root), "CUDA": cuda.compile_scene(root)}
        acts = {key: partial(sample, kernel, root.bounds, LATTICE) for key, kernel in kernels.items()}
        measured = run.interleaved(acts)
        for key in kernels:
            yield {"": name, "samples": "sampler", "by": key, "s": measured.spread(key, "wall_s")}
