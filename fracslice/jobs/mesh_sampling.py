"""Sampling of a shared mesh: large sets of bricks as tasks of a cluster."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from ..cluster import Pool, ResultFolder
from ..common.keys import key, program
from ..errors import ClusterError
from ..volume import Plan
from ..volume.exploration import Evaluate, brick_signs
from ..volume.lattice import BRICK
from ..work import Work, chunks
from .mesh_recipe import MeshRecipe, plan_of

BRICKS = 1 << 17
"""Bricks of a task, about a second."""


@dataclass(frozen=True)
class SampleTask:
    """Signs of some bricks.

    Attributes
    ----------
    recipe : MeshRecipe
        The mesh.
    pieces : ResultFolder
        Folder with the corners of the bricks.
    job : str
        Key of the sampling.
    field : str
        Key of the field.
    step : int
        Number of the set of bricks.
    first, end : int
        Range of the set.
    """

    recipe: MeshRecipe
    pieces: ResultFolder
    job: str
    field: str
    step: int
    first: int
    end: int

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"samples-{self.step:03}-{self.first:09}"

    def make(self, work: Work) -> bytes:
        """Sign bits; see `Task.make`."""
        planned = plan_of(self.recipe)
        if planned.root.key != self.field:
            raise ClusterError("the field planned here is another than that of the job")
        size = 3 * np.dtype(np.int32).itemsize
        data = self.pieces.read(self.job, corners_file(self.step), size * self.first, size * self.end)
        corners = np.frombuffer(data, np.int32).reshape(-1, 3)
        kernel, signs = planned.root.kernel("cpu"), np.empty((len(corners), 64), np.uint8)
        batch = kernel.batch // BRICK**3
        values = np.empty((batch, BRICK**3), np.float32)
        for part in chunks(len(corners), batch):
            here = corners[part]
            signs[part] = brick_signs(kernel, here, planned.lattice, values[: len(here)])
        return signs.tobytes()


def corners_file(step: int) -> str:
    """Name of the file with the corners of a set of bricks."""
    return f"corners-{step:03}"


def by_pool(recipe: MeshRecipe, planned: Plan, pool: Pool, work: Work) -> tuple[str, Evaluate]:
    """Evaluation of bricks by a pool.

    Parameters
    ----------
    recipe : MeshRecipe
        The mesh.
    planned : Plan
        Its field.
    pool : Pool
        Processes that sample.
    work : Work
        Cancellation.

    Returns
    -------
    str
        Key of the sampling, whose files `Pool.finished` removes.
    callable
        For `sample_signs`.
    """
    field, steps = planned.root.key, count()
    job = key(program(), "samples", recipe, field, planned.lattice)

    def evaluate(corners: NDArray[np.int32]) -> NDArray[np.uint8]:
        step = next(steps)
        tasks = [
            SampleTask(recipe, pool.pieces, job, field, step, part.start, part.stop)
            for part in chunks(len(corners), BRICKS)
        ]
        pool.pieces.write(job, corners_file(step), corners.tobytes())
        signs = b"".join(pool.results(tasks, work))
        return np.frombuffer(signs, np.uint8).reshape(-1, 64)

    return job, evaluate
