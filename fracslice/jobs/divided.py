"""The job of an object in parts: their meshes, the beds that they lie on, one file or several, and a picture
of how they belong together.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import concatenate
from ..common.files import check_target, replacing
from ..errors import SceneError
from ..fields.box import Triple
from ..formats import check_format, write
from ..formats._3mf import Built, write_build
from ..mesh import Mesh
from ..records import SAME, UP, MeshJob, PartsJob
from ..scene import Print, Scene
from ..version import APPLICATION
from ..volume.amount import sizing
from ..volume.dividing import BED_TO_BED, Divided, divide, laid_out
from ..work import Work
from .mesh import make_mesh
from .report import Result

APART = 0.25
"""How far parts are drawn from each other, by the longest side of the object."""


@dataclass(frozen=True)
class Parted:
    """Meshes of an object in parts."""

    divided: Divided
    meshes: list[Result]  # of the parts
    peg: Result | None
    bed: Triple | None

    @property
    def named(self) -> list[tuple[str, Result, int]]:
        """Name, mesh and number of copies of each part, and of the peg."""
        parts = [(str(n), mesh, 1) for n, mesh in enumerate(self.meshes, 1)]
        return parts + ([("peg", self.peg, len(self.divided.pegs))] if self.peg else [])

    def placed(self) -> list[Built]:
        """Objects with their places on beds, whose first has its corner at the origin."""
        copies = [(name, mesh.mesh) for name, mesh, count in self.named for _ in range(count)]
        sizes = [(float(mesh.size[0]), float(mesh.size[1])) for _, mesh in copies]
        places: dict[str, list[NDArray[np.float64]]] = {}
        for (name, mesh), (bed, x, y) in zip(copies, laid_out(sizes, self.bed), strict=True):
            start = bed * BED_TO_BED * self.bed[0] if self.bed else 0.0
            low = mesh.bounds[0]
            moved = np.vstack([np.eye(3), [start + x - low[0], y - low[1], 0.0]])
            places.setdefault(name, []).append(moved)
        meshes = dict(copies)
        return [Built(meshes[name], some, name) for name, some in places.items()]

    @property
    def beds(self) -> int:
        """Number of beds."""
        sizes = [tuple(mesh.mesh.size[:2].tolist()) for _, mesh, count in self.named for _ in range(count)]
        return 1 + max(bed for bed, _, _ in laid_out(sizes, self.bed))

    def exploded(self) -> Mesh:
        """All parts where they belong, moved away from each other, and the pegs between them."""
        return concatenate(list(self._apart()))

    def _apart(self) -> Iterator[Mesh]:
        meshes = zip(self.divided.parts, self.meshes, strict=True)
        solids = [(part.cell, made.mesh.translated(-np.array(made.place.offset))) for part, made in meshes]
        step = APART * float(np.ptp(np.concatenate([mesh.bounds for _, mesh in solids]), axis=0).max())
        for cell, mesh in solids:
            yield mesh.translated(step * np.array(cell, float))
        if self.peg is None:
            return
        for peg in self.divided.pegs:
            low = np.array(self.divided.low) * self.divided.unit
            middle = low + np.array(peg.middle) + step * np.mean(peg.cells, axis=0)
            centred = self.peg.mesh.vertices - self.peg.mesh.bounds.mean(0)
            turned: NDArray[np.float64] = np.roll(centred, peg.axis + 1, axis=1)
            yield Mesh(turned + middle, self.peg.mesh.triangles)


def make_parts(
    scene: Scene, what: MeshJob, how: PartsJob, work: Work | None = None, path: str | Path | None = None
) -> Parted:
    """Make the meshes of an object in parts.

    `path`: file that the meshes are for. Raises what `divide` and `make_mesh` raise, and SceneError for
    edits.
    """
    work = work or Work()
    if what.edits(scene) != Print():
        raise SceneError(
            "parts: expected no changes for printing, such as a base, of which each part had one"
        )
    if what.colour is not None:
        raise SceneError("parts: expected no colours")
    if path is not None:
        check_format(path)
        check_target(path)
    size = sizing(scene, what.size, what.scale, work)
    voxel = size.longest / what.voxels(size.longest)
    own = replace(what, voxel=voxel, resolution=None, size=None, up=UP, scale=SAME, printing=Print())
    divided = divide(scene, how, what, work)
    meshes = [make_mesh(part.scene, own, work) for part in divided.parts]
    peg = make_mesh(divided.peg, replace(own, voxel=None, resolution=64), work) if divided.pegs else None
    return Parted(divided, meshes, peg, how.bed)


def write_parts(made: Parted, path: str | Path, about: dict[str, str], work: Work) -> list[Path]:
    """Write the parts to one .3mf file, laid on beds, or each to a file of its own. Returns the files."""
    path = Path(path)
    if path.suffix.lower() != ".3mf":
        names = [path.with_name(f"{path.stem}-{name}{path.suffix}") for name, _, _ in made.named]
        for name in names:
            check_target(name)
        pairs = zip(names, made.named, strict=True)
        return [write(mesh.mesh, name, about, work) for name, (_, mesh, _) in pairs]
    with replacing(path) as file:
        write_build(made.placed(), file, {"Application": APPLICATION} | about, work)
    return [path]
