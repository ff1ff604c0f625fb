"""The job of an object in parts: their meshes, the beds that they lie on, one file or several, and a picture
of how they belong together.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import concatenate
from ..common.files import check_target
from ..errors import SceneError
from ..fields.box import Triple
from ..fields.field import Field
from ..formats import check_format
from ..mesh import Mesh
from ..mesh.filaments import chosen_filaments
from ..printing.dividing import Divided, divide
from ..records import SAME, UP, MeshJob, PartsJob
from ..scene import Print, Scene
from ..slicing.packing import Beds
from ..volume.amount import sizing
from ..work import Work
from .colouring import Colouring, refuse_colours
from .mesh import make_mesh, mesh_of_part
from .mesh_steps import apply_edits, plan_mesh
from .plates import LaidOut, lay_out, write_each
from .report import Clock, Result

GAP = 5.0
"""Distance between parts on a bed of a filament printer, mm."""

APART = 0.25
"""How far parts are drawn from each other, by the longest side of the object."""


@dataclass(frozen=True, eq=False)
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

    @cached_property
    def laid_out(self) -> LaidOut:
        """All on beds."""
        meshes = [mesh.mesh for _, mesh, _ in self.named]
        places = [k for k, (_, _, count) in enumerate(self.named) for _ in range(count)]
        names = [f"part {self.named[k][0]}" for k in places]
        return lay_out(meshes, places, names, Beds(self.bed and self.bed[:2], GAP, most=None))

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
            yield replace(self.peg.mesh, vertices=turned + middle)


def make_parts(
    scene: Scene, what: MeshJob, how: PartsJob, work: Work | None = None, path: str | Path | None = None
) -> Parted:
    """Make the meshes of an object in parts.

    `path`: file that the meshes are for. Raises what `divide` and `make_mesh` raise, and SceneError for
    supports.
    """
    work = work or Work()
    if what.edits(scene).supports != "none":
        raise SceneError("parts: expected no supports, as each part lies on the plate by itself")
    refuse_colours(what, path)
    if path is not None:
        check_format(path)
        check_target(path)
    size, clock = sizing(scene, what.size, what.scale, work), Clock(work)
    sized = plan_mesh(scene, what, size, clock)
    if sized.left.sorts:
        sized = apply_edits(sized.planned, scene, what, size, clock)
    divided = divide(sized.planned, sized.scale, how, work)
    voxel = sized.planned.voxel * sized.scale
    own = replace(what, voxel=voxel, resolution=None, printing=Print(), **UNCOLOURED)
    meshes = [mesh_of_part(scene, sized.planned, sized.scale, part.root, own, work) for part in divided.parts]
    upright = replace(own, voxel=None, resolution=64, size=None, up=UP, scale=SAME)
    peg = make_mesh(divided.peg, upright, work) if divided.pegs else None
    made = Parted(divided, meshes, peg, how.bed)
    return made if what.colour is None else _coloured(made, Colouring(sized.planned.root, what, work))


UNCOLOURED: dict[str, Any] = {"colour": None, "palette": None, "filaments": None, "bodies": False}
"""Parts are coloured once all are made, as they share their filaments."""


def _coloured(made: Parted, colouring: Colouring) -> Parted:
    """Parts with the colours of the object, of the filaments that suit its surface. Pegs have none: slicers
    print them of the first filament.
    """
    parts = made.meshes
    meshes = [colouring.coloured(part.mesh, part.place) for part in parts]
    if (wanted := colouring.what.filaments) is not None:
        surface = concatenate([_outside(part, colouring.root) for part in parts])
        filaments = chosen_filaments(surface, wanted, lambda points: colouring.paint(points).colours)
        pairs = zip(meshes, parts, strict=True)
        meshes = [colouring.printed(mesh, part.place, filaments) for mesh, part in pairs]
    coloured = zip(parts, meshes, strict=True)
    results = [Result(part.report, part.place, part.planned, mesh, part.work) for part, mesh in coloured]
    return replace(made, meshes=results)


def _outside(part: Result, whole: Field) -> Mesh:
    """Triangles of a part that are not deeper than a voxel in the whole object, scene units."""
    corners = part.place.units(part.mesh.corners.reshape(-1, 3)).reshape(-1, 3, 3)
    x, y, z = np.ascontiguousarray(corners.mean(1).T)
    outer = whole.kernel().points(x, y, z) > -whole.bounds.lipschitz * part.planned.voxel
    return Mesh(corners[outer].reshape(-1, 3), np.arange(3 * outer.sum(), dtype=np.int32).reshape(-1, 3))


def write_parts(made: Parted, path: str | Path, about: dict[str, str], work: Work) -> list[Path]:
    """Write the parts to one .3mf file, laid on beds, or each to a file of its own. Returns the files."""
    path, names = Path(path), [name for name, _, _ in made.named]
    if path.suffix.lower() != ".3mf":
        return write_each([mesh.mesh for _, mesh, _ in made.named], names, path, about, work)
    made.laid_out.write(path, about, work, names)
    return [path]
