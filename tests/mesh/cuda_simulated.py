"""Run by test_crossings.py in a process of its own, on Numba's CUDA simulator, and fails as a test does."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from unittest import mock

import numpy as np
import pytest

from fracslice._native import Cells
from fracslice.errors import Cancelled
from fracslice.formulas import torus
from fracslice.mesh import contouring
from fracslice.mesh.contouring import Crossings, Refiner, contour_pieces
from fracslice.volume import plan, sample_scene_signs
from fracslice.work import Work

PLANNED = plan(torus(radius=1, tube=0.3), 12)
SIGNS = sample_scene_signs(PLANNED)
CELLS = Cells(SIGNS.ijk, SIGNS.signs, SIGNS.index)
COUNT = CELLS.crossings_before(len(SIGNS.index))
GPU = Work(1, device="cuda")


class Watched(Refiner):
    """Tells when a range has been searched."""

    def __init__(self, work: Work) -> None:
        super().__init__(PLANNED.root, CELLS, SIGNS.origin, SIGNS.voxel, work)
        self.searched = threading.Semaphore(0)

    def between(self, begin: int, end: int) -> Crossings:
        try:
            return super().between(begin, end)
        finally:
            self.searched.release()


def roots() -> None:
    """A thread per grid edge finds the crossings and normals of the lanes."""
    lanes, threads = (Watched(work).between(0, COUNT) for work in (Work(1), GPU))
    assert COUNT > 250
    np.testing.assert_allclose(threads.t, lanes.t, atol=1e-6)
    np.testing.assert_allclose(threads.normals, lanes.normals, atol=1e-4)


def kept() -> None:
    """The roots of a range stay while those of the next are found, whatever both share."""
    whole, parts = Watched(GPU).between(0, COUNT), Watched(GPU)
    ranges = [(begin, min(begin + 90, COUNT)) for begin in range(0, COUNT, 60)]
    for number, part in enumerate(parts.each(ranges)):
        for _ in range(2 if number == 0 else number + 1 < len(ranges)):  # this one and the next, or the next
            assert parts.searched.acquire(timeout=60), "the next range is not searched meanwhile"
        own = slice(part.first, part.first + len(part.t))
        assert (own.start, own.stop) == ranges[number]
        np.testing.assert_array_equal(part.t, whole.t[own])
        np.testing.assert_array_equal(part.normals, whole.normals[:, own])


@contextmanager
def small_batches() -> Iterator[None]:
    batches = contouring._batches
    with mock.patch.object(contouring, "_batches", lambda *given: batches(*given[:3], 1)):
        yield


def pieces() -> None:
    """A surface is the same in one batch, in several, and in pieces with one root finder."""
    (whole,) = contour_pieces(PLANNED.root, SIGNS, GPU, len(SIGNS))
    with small_batches():
        (batched,) = contour_pieces(PLANNED.root, SIGNS, GPU, len(SIGNS))
        several = list(contour_pieces(PLANNED.root, SIGNS, GPU, 1))
    assert len(several) > 2
    for name in ("vertices", "triangles"):
        np.testing.assert_array_equal(getattr(batched.mesh, name), getattr(whole.mesh, name))
    points = np.unique(np.concatenate([piece.mesh.vertices for piece in several]), axis=0)
    np.testing.assert_array_equal(points, np.unique(whole.mesh.vertices, axis=0))
    assert sum(len(piece.mesh.triangles) for piece in several) == len(whole.mesh.triangles)


def interrupted() -> None:
    """What ends the search of a range ahead is raised where that range is asked for."""
    work = Work(1, device="cuda")
    found = Watched(work).each([(0, 60), (30, 120), (90, 150)])
    next(found)
    work.cancel.set()
    with pytest.raises(Cancelled):
        list(found)
    assert next(found, None) is None


def main() -> None:
    roots()
    kept()
    pieces()
    interrupted()


if __name__ == "__main__":
    main()
