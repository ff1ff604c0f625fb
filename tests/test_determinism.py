"""Meshes, slices and pictures are the same bytes for any number of threads, from a kernel's first call on.

What threads do to each other is a matter of chance, so kernels are made anew many times, the work is cut
small, and the interpreter changes threads as often as it can.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fracslice.fields import cpu
from fracslice.fields.cpu import CpuKernel, compile_scene
from fracslice.fields.linker import link
from fracslice.formulas import difference, julia, sphere, transform, union
from fracslice.mesh.contouring import contour
from fracslice.printing.walls import Walls
from fracslice.rendering import Renderer
from fracslice.rendering import packets as tiles
from fracslice.rendering.accumulator import develop
from fracslice.scene.view import Film, View
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.volume import Lattice, sample
from fracslice.work import Work
from tests.threads import hurried, together

pytestmark = pytest.mark.once

ROOT = difference(julia(iterations=3), sphere(radius=0.5))


def sampled(work: Work) -> bytes:
    """Some bricks, by all threads at once."""
    kernel, corners = compile_scene(ROOT), np.array([(0, 0, 0), (8, 0, 16)], np.int32)

    def bricks() -> bytes:
        out = np.empty((2, 512), np.float32)
        kernel.bricks(corners, (-1.5, -1.25, -1.375), 0.125, out)
        return out.tobytes()

    return b"".join(set(together(work.threads, bricks)))


def meshed(work: Work) -> bytes:
    lattice = Lattice.around(ROOT.bounds.box, 0.1)
    bricks = sample(compile_scene(ROOT), ROOT.bounds, lattice, work)
    mesh = contour(ROOT, bricks, work)
    return bricks.values.tobytes() + mesh.vertices.tobytes() + mesh.triangles.tobytes()


def sliced(work: Work) -> bytes:
    stack = plan_stack(ROOT, SliceJob(size=4, layer=0.1, pixel=(0.1, 0.1)))
    layers = Slicer(stack, work).map(lambda layer: layer.coverage.tobytes() + layer.contours.points.tobytes())
    return b"".join(layers)


def rendered(work: Work) -> bytes:
    *_, last = Renderer(ROOT, View(), (32, 24), work, "cpu").passes(samples=2)
    return last.image.tobytes()


MAKE: dict[str, Callable[[Work], bytes]] = {
    "samples": sampled,
    "mesh": meshed,
    "slices": sliced,
    "picture": rendered,
}


def made(name: str, threads: int) -> str:
    """The hash of what new kernels make."""
    for known in (cpu._kernel, cpu.compile_loops):
        known.cache_clear()
    return hashlib.sha256(MAKE[name](Work(threads=threads))).hexdigest()


TIMES = {"samples": 60, "mesh": 20, "slices": 6, "picture": 6}


@pytest.mark.parametrize(("name", "times"), TIMES.items())
def test_new_kernels_and_many_threads_change_no_bit(name: str, times: int) -> None:
    """In a new process where memory is overwritten as it is freed, so that who reads it then is seen."""
    program = f"from tests.test_determinism import made_often; made_often({name!r}, {times})"
    run = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "MALLOC_PERTURB_": "213"},
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(run.stdout) == [made(name, 1)]


def made_often(name: str, times: int) -> None:
    """Prints the hashes of what many threads make: all different ones of so many times."""
    with pytest.MonkeyPatch.context() as patch, hurried():
        patch.setattr(CpuKernel, "batch", 512 * 4)
        patch.setattr(tiles, "TILE", 64)
        print(json.dumps(sorted({made(name, 8) for _ in range(times)})))


def test_no_bit_depends_on_the_processor_s_algebra() -> None:
    """A library of linear algebra sums in the order that suits a processor; sums over points are not its."""
    program = "from tests.test_determinism import summed; summed()"
    result = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "OPENBLAS_CORETYPE": core},
            cwd=Path(__file__).parents[1],
            capture_output=True,
            check=True,
        ).stdout
        for core in ("Nehalem", "Haswell")
    }
    assert len(result) == 1


def summed() -> None:
    """Prints the hashes of sums over the coordinates or colours of many points, and of a turned scene."""
    rng = np.random.default_rng(0)
    light, ends = rng.random((64, 64, 4), np.float32), rng.random((2, 1000, 3))
    sums = (
        develop(light, View(film=Film(tone="reinhard"))),
        Walls(*ends, *rng.random((3, 1000))).along((0.48, 0.6, 0.64)).width,
    )
    turned = [transform(sphere(), rotate=(1, k, 2, 7 * k), scale=0.1 * k) for k in range(1, 41)]
    sums = *sums, link(union(*turned)).parameters
    print([hashlib.sha256(np.ascontiguousarray(result).tobytes()).hexdigest() for result in sums])
