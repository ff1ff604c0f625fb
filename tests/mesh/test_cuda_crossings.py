"""Search of crossings on a GPU, whose threads the CPU runs, against the lanes."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from fracslice._native import Cells
from fracslice.errors import Cancelled
from fracslice.formulas import torus
from fracslice.mesh import contouring
from fracslice.mesh.contouring import Crossings, Refiner, contour_pieces
from fracslice.volume import plan, sample_scene_signs
from fracslice.work import Work
from tests.kernel.cuda_host import HostDriver, runs_on_cpu

pytestmark = pytest.mark.once

PLANNED = plan(torus(radius=1, tube=0.3), 12)
SIGNS = sample_scene_signs(PLANNED)
CELLS = Cells(SIGNS.ijk, SIGNS.signs, SIGNS.index)
COUNT = CELLS.crossings_before(len(SIGNS.index))
GPU = Work(1, device="cuda")


@pytest.fixture(autouse=True)
def threads(monkeypatch: pytest.MonkeyPatch) -> Iterator[HostDriver]:
    yield from runs_on_cpu(monkeypatch)


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


def test_crossings_and_normals_are_those_of_the_lanes() -> None:
    lanes, threads = (Watched(work).between(0, COUNT) for work in (Work(1), GPU))
    assert COUNT > 250
    np.testing.assert_allclose(threads.t, lanes.t, atol=1e-6)
    np.testing.assert_allclose(threads.normals, lanes.normals, atol=1e-4)


def test_roots_of_a_range_stay_while_those_of_the_next_are_found() -> None:
    whole, parts = Watched(GPU).between(0, COUNT), Watched(GPU)
    ranges = [(begin, min(begin + 90, COUNT)) for begin in range(0, COUNT, 60)]
    for number, part in enumerate(parts.each(ranges)):
        for _ in range(2 if number == 0 else number + 1 < len(ranges)):  # this one and the next, or the next
            assert parts.searched.acquire(timeout=60), "the next range is not searched meanwhile"
        own = slice(part.first, part.first + len(part.t))
        assert (own.start, own.stop) == ranges[number]
        np.testing.assert_array_equal(part.t, whole.t[own])
        np.testing.assert_array_equal(part.normals, whole.normals[:, own])


def test_a_surface_is_the_same_in_batches_and_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    (whole,) = contour_pieces(PLANNED.root, SIGNS, GPU, len(SIGNS))
    batches = contouring._batches
    monkeypatch.setattr(contouring, "_batches", lambda *given: batches(*given[:3], 1))
    (batched,) = contour_pieces(PLANNED.root, SIGNS, GPU, len(SIGNS))
    several = list(contour_pieces(PLANNED.root, SIGNS, GPU, 1))
    assert len(several) > 2
    for name in ("vertices", "triangles"):
        np.testing.assert_array_equal(getattr(batched.mesh, name), getattr(whole.mesh, name))
    points = np.unique(np.concatenate([piece.mesh.vertices for piece in several]), axis=0)
    np.testing.assert_array_equal(points, np.unique(whole.mesh.vertices, axis=0))
    assert sum(len(piece.mesh.triangles) for piece in several) == len(whole.mesh.triangles)


def test_what_ends_a_search_ahead_is_raised_where_its_range_is_asked_for() -> None:
    work = Work(1, device="cuda")
    found = Watched(work).each([(0, 60), (30, 120), (90, 150)])
    next(found)
    work.cancel.set()
    with pytest.raises(Cancelled):
        list(found)
    assert next(found, None) is None
