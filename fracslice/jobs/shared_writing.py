"""Files of shared meshes: an STL file whose ranges are written by tasks, and other formats."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..cluster import PAGE, Contents, packed, unpacked
from ..common.files import flushing, linked, replacing
from ..errors import ClusterError
from ..export import FORMATS, stl
from ..export.threemf import write_fragments
from ..mesh.model import Mesh
from ..work import Work
from .finished_pieces import joined_pieces, piece_rows, read_finished
from .finishing import Finish
from .mesh_tasks import FinishTask, MeshTask, finished_file
from .shared_finishing import SharedCheck, finished
from .shared_mesh import SharedSurface, leave_to_the_first
from .shared_packing import model_rows

FILE, PLACES = "file.stl", "places"
"""Files of a job: the STL file, and the first triangle of each piece in it."""

FIRST = -stl.HEADER // 2 * pow(stl.TRIANGLE // 2, -1, PAGE // 2) % (PAGE // 2)
"""First triangle that begins at a multiple of `PAGE` bytes; from there on, every `PAGE // 2`th one does."""

ROWS = 160 * PAGE // 2
"""Triangles of a task, 260 MB."""


class PlaceTask(MeshTask):
    """Writes a range of the triangles to its place in the STL file."""

    stage = "placed"

    def make(self, work: Work) -> Contents:
        """Write the range; the result is empty. See `Task.make`."""
        about = unpacked(self.pieces.read(self.job, PLACES))
        begin, end = place(self.number), place(self.number + 1)
        start = stl.HEADER + stl.TRIANGLE * begin if begin else 0

        def blocks() -> Iterator[bytes | memoryview]:
            if not begin:
                yield about["header"].tobytes()
            for number, rows in piece_rows(about["starts"], begin, end):
                mesh = read_finished(self.pieces, self.job, finished_file(number))
                yield from stl.blocks(Mesh(mesh.vertices, mesh.triangles[rows]), work.threads)

        self.pieces.put(self.job, FILE, start, blocks())
        return b""


def place(number: int) -> int:
    """First triangle of a task."""
    return FIRST + number * ROWS if number else 0


def placed(surface: SharedSurface, rows: list[int], about: dict[str, str]) -> str:
    """Write an STL file by tasks, in the folder of the results.

    Parameters
    ----------
    surface : SharedSurface
        Surface whose finished triangles are files of the job.
    rows : list of int
        Triangles of each file.
    about : dict
        Names and values; the header holds Application.

    Returns
    -------
    str
        Path of the file.

    Raises
    ------
    SharedError
        For a shard that does not write the output, when its ranges are written.
    ClusterError
        If the file is not complete.
    """
    pool, job, total = surface.pool, surface.job, sum(rows)
    head = np.frombuffer(stl.header(total, about), np.uint8)
    pool.pieces.write(job, PLACES, packed(starts=np.cumsum([0, *rows]), header=head))
    count = max(-(-(total - FIRST) // ROWS), 1)
    tasks = surface.tasks(PlaceTask, range(count))
    leave_to_the_first(surface, tasks)
    for _ in pool.make(tasks, surface.clock.work, "writing"):
        pass
    path = pool.pieces.path(f"{job}/{FILE}")
    assert path is not None
    if not os.path.exists(path) or os.path.getsize(path) != stl.HEADER + stl.TRIANGLE * total:
        raise ClusterError(f"{path}: expected {total} triangles; remove the folder and start again")
    return path


def write_shared(
    surface: SharedSurface, finish: Finish, path: Path | None, about: dict[str, str]
) -> tuple[SharedCheck, Mesh | None]:
    """Finish, write and check a shared mesh.

    Parameters
    ----------
    surface : SharedSurface
        The surface.
    finish : Finish
        Selection and placement.
    path : Path or None
        File to write.
    about : dict
        Names and values of its metadata.

    Returns
    -------
    SharedCheck
        Checks and measures.
    Mesh or None
        The mesh, of formats and stores that need it whole.
    """
    pool, job, ending = surface.pool, surface.job, "" if path is None else path.suffix.lower()
    check, names = finished(surface, finish)
    meshes, mesh = (read_finished(pool.pieces, job, name) for name in names), None
    if path and ending == ".3mf":
        count = sum(1 for _ in names)
        rows = model_rows(surface, tips=len(surface.pieces) if count > len(surface.pieces) else 0)
        with replacing(path) as file, flushing(file):
            write_fragments(*rows, file, about)
    elif path and ending == ".stl" and pool.pieces.is_local:
        for _ in names:
            pass
        linked(placed(surface, check.rows, about), path)
    else:
        leave_to_the_first(surface, surface.tasks(FinishTask, range(len(surface.pieces))))
        if ending != ".stl":
            mesh = joined_pieces(meshes)
        if path:
            with replacing(path) as file, flushing(file):
                if mesh is None:
                    stl.write_pieces(meshes, file, about, surface.clock.work)
                else:
                    FORMATS[ending](mesh, file, about, surface.clock.work)
    check.end()
    return check, mesh
