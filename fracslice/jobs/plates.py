"""Plates of many parts: layers of all in one file, and meshes of all in one file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.cache import key
from ..errors import SliceError
from ..export.slice_run import Encode, SliceRun
from ..formulas import transform, union
from ..slicing import Stack
from ..slicing.packing import (
    SPACING,
    Beds,
    Spot,
    cell_for,
    corners,
    outline_of_layers,
    outline_of_mesh,
    packed,
    plate_of,
    turns_for,
)
from ..slicing.raster import Screen, check_fits
from ..volume import with_depths
from ..work import Work
from .slices import SliceRecipe, StackModel, rendered

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..slicing.stack import Standing
    from .report import Result


@dataclass(frozen=True)
class PlateRecipe:
    """Parts of a plate, and how far apart they stand: enough for any process to plan the same layers.

    Printer, format, resin and date are those of the first part.
    """

    parts: tuple[SliceRecipe, ...]  # the parts, each as often as it stands on the plate
    spacing: float = SPACING  # distance between parts, mm
    bed: tuple[float, float] | None = None  # width and depth, mm, if there is no printer; None for no limits

    @property
    def form(self) -> str:
        """Format of the file."""
        return self.parts[0].form

    def encoder(self, run: SliceRun) -> Encode:
        """Return the function that encodes the layers of a run in this format; see `Recipe.encoder`."""
        return self.parts[0].encoder(run)

    def run(self, work: Work) -> SliceRun:
        """Plan and place all parts; see `Recipe.run`. Equal parts are planned and sliced once.

        Raises `SliceError` if they do not fit.
        """
        first, job = self.parts[0], self.parts[0].job
        if job.layer[1] is not None:
            raise SliceError("layer: parts of a plate have layers of one height: expected no range")
        scenes = {part: part.read() for part in dict.fromkeys(self.parts)}
        stacks = {part: part.plan(scene, work) for part, scene in scenes.items()}
        plate = self._plate(stacks, work)
        models = [StackModel(scene, part.job, replace(work, cluster=None)) for part, scene in scenes.items()]
        places = [list(scenes).index(part) for part in self.parts]
        whole = PlateModel(plate, models, places)
        names = ", ".join(part.name for part in scenes)
        about = {"Title": names, "scene_hash": key(*(scenes[part].hash for part in self.parts))}
        files = about, whole.mesh, whole.picture, first.created
        return SliceRun(
            plate, Screen.of(plate, job, first.resin), work, first.resin, *files, job.sections, self
        )

    def _plate(self, stacks: dict[SliceRecipe, Stack], work: Work) -> Stack:
        """Place the parts."""
        job = self.parts[0].job
        printer, pixel = job.printer, job.pixels
        bed, where = self.bed, "the bed"
        if printer:
            for part, stack in stacks.items():
                with named(part.name):
                    check_fits(stack, printer, max(job.compensation, 0.0))
            bed, where = (printer.screen[0] - pixel[0], printer.screen[1] - pixel[1]), f"the {printer.title}"
        cell = cell_for(bed, [max(stacks[part].size[:2]) for part in self.parts])
        outlines = {part: outline_of_layers(stack, cell, work) for part, stack in stacks.items()}
        beds = Beds(bed, self.spacing + 2 * max(job.compensation, 0.0), where, turns_for(pixel))
        names = [part.name for part in self.parts]
        spots = packed([outlines[part] for part in self.parts], names, cell, beds)
        return plate_of([stacks[part] for part in self.parts], spots)


@contextmanager
def named(name: str) -> Iterator[None]:
    """Put the name of a part before its errors."""
    try:
        yield
    except SliceError as error:
        raise SliceError(f"{name}: {error}") from None


@dataclass(frozen=True)
class PlateModel:
    """The objects of a plate."""

    plate: Stack  # the plate
    models: Sequence[StackModel]  # the parts, each once
    places: Sequence[int]  # part at each place of the plate

    def mesh(self) -> Mesh:
        """Meshes of all parts at their places; see `StackModel.mesh`."""
        from ..common.arrays import concatenate

        meshes = [model.mesh() for model in self.models]
        standing = zip(self.plate.parts, self.places, strict=True)
        return concatenate([_moved(meshes[k], part, self.plate.shape) for part, k in standing])

    def picture(self) -> NDArray[np.uint8]:
        """Render all parts at their places; see `StackModel.picture`."""
        made = []
        for part, k in zip(self.plate.parts, self.places, strict=True):
            stack, node = part.stack, with_depths(self.models[k].upright)
            (middle,) = part.moved(np.zeros((1, 2)), self.plate.shape)
            lying = transform(node, translate=tuple(-at for at in stack.origin))
            turned = transform(lying, rotate=(0, 0, 1, 90 * part.turns), scale=stack.scale)
            made.append(transform(turned, translate=(*middle.tolist(), 0.0)))
        return rendered(union(*made), self.models[0].work)


def _moved(mesh: Mesh, part: Standing, plate: tuple[int, int]) -> Mesh:
    """Mesh of a part at its place on a plate.

    `mesh` in mm; `plate`: rows and columns of the plate.
    """
    flat = part.moved(mesh.vertices[:, :2], plate)
    return replace(mesh, vertices=np.column_stack([flat, mesh.vertices[:, 2]]))


BED_TO_BED = 1.2
"""Distance of beds by their width, as in Bambu Studio and OrcaSlicer."""


class Item(NamedTuple):
    """A mesh on a bed."""

    mesh: int  # number of the mesh
    bed: int
    place: NDArray[np.float64]  # how it is moved from the corner of the bed; see `Built`


@dataclass(frozen=True, eq=False)
class LaidOut:
    """Meshes on beds, the first of which has its corner at the origin."""

    meshes: Sequence[Mesh]  # each once, mm
    items: Sequence[Item]
    width: float = 0.0  # of a bed, mm; 0 without limits

    @property
    def beds(self) -> int:
        """Number of beds."""
        return 1 + max(item.bed for item in self.items)

    def on_bed(self, bed: int) -> LaidOut:
        """What lies on one bed."""
        here = [item._replace(bed=0) for item in self.items if item.bed == bed]
        return LaidOut(self.meshes, here, self.width)

    def places(self, mesh: int) -> list[NDArray[np.float64]]:
        """Places of a mesh on all beds, side by side."""
        step = np.array([[0.0] * 3] * 3 + [[BED_TO_BED * self.width, 0.0, 0.0]])
        return [item.place + item.bed * step for item in self.items if item.mesh == mesh]

    @property
    def whole(self) -> Mesh:
        """All as one mesh."""
        from ..common.arrays import concatenate, product
        from ..mesh import Mesh

        return concatenate(
            [
                Mesh(product(mesh.vertices, place[:3]) + place[3], mesh.triangles, mesh.colours)
                for number, mesh in enumerate(self.meshes)
                for place in self.places(number)
            ]
        )

    def write(self, path: str | Path, about: Mapping[str, str], work: Work, names: Sequence[str]) -> None:
        """Write all to one file.

        A .3mf file holds each mesh once, and an item of the build for each place; other files hold triangles.

        `about`: metadata; `names`: of the meshes, in a .3mf file.
        """
        from ..common.files import replacing
        from ..formats import write
        from ..formats._3mf import Built, write_build
        from ..version import APPLICATION

        if Path(path).suffix.lower() != ".3mf":
            write(self.whole, path, about, work)
            return
        named = enumerate(zip(self.meshes, names, strict=True))
        built = [Built(mesh, places, name) for k, (mesh, name) in named if (places := self.places(k))]
        with replacing(path) as file:
            write_build(built, file, {"Application": APPLICATION, **about}, work, self.whole.thumbnail())


def write_each(
    meshes: Sequence[Mesh], names: Sequence[str], path: Path, about: Mapping[str, str], work: Work
) -> list[Path]:
    """Write each mesh to a file of its own, whose name ends in its name. Returns the files."""
    from ..common.files import check_target
    from ..formats import write

    files = [path.with_name("-".join(filter(None, (path.stem, name))) + path.suffix) for name in names]
    for file in files:
        check_target(file)
    return [write(mesh, file, about, work) for mesh, file in zip(meshes, files, strict=True)]


def write_bodies(
    made: Sequence[Result], names: Sequence[str], path: Path, about: Mapping[str, str], work: Work
) -> list[Path]:
    """Write meshes of one scene where they belong: as bodies of one object in a .3mf file, or each to a file
    of its own. The lowest one stands on z = 0. Returns the files.
    """
    from ..common.files import check_target, replacing
    from ..formats._3mf import Built, write_build
    from ..version import APPLICATION

    at = [np.array(one.place.offset) for one in made]
    lowest = at[int(np.argmax([offset[2] for offset in at]))]
    meshes = [one.mesh.translated(lowest - offset) for one, offset in zip(made, at, strict=True)]
    if path.suffix.lower() != ".3mf":
        return write_each(meshes, names, path, about, work)
    check_target(path)
    built = [Built(m, [np.eye(4, 3)], name) for m, name in zip(meshes, names, strict=True)]
    with replacing(path) as file:
        write_build(built, file, {"Application": APPLICATION, **about}, work, together=True)
    return [path]


def lay_out(
    meshes: Sequence[Mesh], places: Sequence[int], names: Sequence[str], beds: Beds, height: float = math.inf
) -> LaidOut:
    """Place meshes, each standing on z = 0 and centred.

    Parameters
    ----------
    meshes : sequence of Mesh
        The meshes, each once, mm.
    places : sequence of int
        Number of the mesh of each part.
    names : sequence of str
        Name of each part, for errors.
    beds : Beds
        Beds for them.
    height : float
        Height that is free above a bed, mm.

    Returns
    -------
    LaidOut
        The meshes at their places.

    Raises
    ------
    SliceError
        If the parts do not fit.
    """
    sides = [np.ptp(mesh.vertices, 0) for mesh in meshes]
    for k, name in zip(places, names, strict=True):
        if sides[k][2] > height * (1 + 1e-6):
            raise SliceError(f"{name}: {sides[k][2]:.6g} mm high, {beds.name} has {height:.6g} mm")
    cell = cell_for(beds.sides, [float(sides[k][:2].max()) for k in places])
    outlines = [outline_of_mesh(mesh, cell) for mesh in meshes]
    placed = [outlines[k] for k in places]
    spots = packed(placed, names, cell, beds)
    middle = np.array(beds.sides) / 2 if beds.sides else corners(placed, spots)[1]
    items = [Item(k, spot.bed, _transform(spot, middle)) for k, spot in zip(places, spots, strict=True)]
    return LaidOut(meshes, items, beds.sides[0] if beds.sides else 0.0)


def _transform(spot: Spot, middle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Four rows by which points, as rows, are moved to a spot, as 3MF has them.

    `middle`: of the bed, mm.
    """
    cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[spot.turns]
    return np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1], [*(middle + spot.middle), 0]], float)
