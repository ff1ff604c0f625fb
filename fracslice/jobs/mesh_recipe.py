"""What a shared mesh is made from: its recipe, and the plan and samples that a process keeps of it."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import lru_cache

from ..cluster import ResultFolder, unpacked
from ..common.keys import key, program
from ..errors import ClusterError
from ..mesh.contouring import SurfaceContours
from ..meshjob import MeshJob
from ..scene.reader import reads
from ..volume import Plan, SignBricks
from ..volume.sizing import sizing
from ..work import Work
from .clock import Clock
from .planning import edited, planned

SAMPLES = "samples"
"""File of a job with its samples."""


@dataclass(frozen=True)
class MeshRecipe:
    """Everything that a mesh is made from; a worker plans it once.

    Attributes
    ----------
    scene, name : str
        XML and name of the scene.
    what : MeshJob
        Size, resolution and changes of the mesh.
    edited : bool
        True if the bodies of the scene are chosen in the field; see `planning.edited`.
    """

    scene: str
    name: str
    what: MeshJob
    edited: bool = False

    def plan(self) -> Plan:
        """Plan the field.

        Returns
        -------
        Plan
            The same in every process.
        """
        scene, clock = reads(self.scene, self.name), Clock(Work(threads=1))
        size = sizing(scene, self.what.size_mm, self.what.scale, clock.work)
        sized = planned(scene, self.what, size, clock)
        return (edited(sized.planned, scene, self.what, size, clock) if self.edited else sized).planned


@dataclass(frozen=True, eq=False)
class Sampled:
    """A planned field and its samples.

    Attributes
    ----------
    planned : Plan
        The field.
    signs : SignBricks
        Its samples.
    contours : SurfaceContours
        Pieces of its surface.
    """

    planned: Plan
    signs: SignBricks
    contours: SurfaceContours


def samples_key(recipe: MeshRecipe, root_key: str, signs: SignBricks) -> str:
    """Key of a sampled field."""
    return key(program(), recipe, root_key, signs.origin, signs.voxel, signs.ijk, signs.signs)


_READING = threading.Lock()
_planned = lru_cache(maxsize=2)(MeshRecipe.plan)


def plan_of(recipe: MeshRecipe) -> Plan:
    """Plan of a recipe, made once in a process."""
    with _READING:
        return _planned(recipe)


def sampled(recipe: MeshRecipe, pieces: ResultFolder, job: str) -> Sampled:
    """Field and samples of a job, planned and read once in a process.

    Parameters
    ----------
    recipe : MeshRecipe
        The mesh.
    pieces : ResultFolder
        Folder with the files of the job.
    job : str
        Key of the job.

    Raises
    ------
    ClusterError
        If another field is planned here.
    """
    with _READING:
        return _sampled(recipe, pieces, job)


@lru_cache(maxsize=1)
def _sampled(recipe: MeshRecipe, pieces: ResultFolder, job: str) -> Sampled:
    made, files = _planned(recipe), unpacked(pieces.read(job, SAMPLES))
    lattice = made.lattice
    signs = SignBricks(lattice.origin, lattice.voxel, files["ijk"], files["signs"], files["index"])
    if samples_key(recipe, made.root.key, signs) != str(files["key"]):
        raise ClusterError("the field planned here is another than that of the job")
    return Sampled(made, signs, SurfaceContours(made.root, signs, threads=1))
