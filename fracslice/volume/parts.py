"""Other solids of a scene: filled with a lattice, or cut by a plane. Lengths are mm of the whole object."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..errors import VolumeError
from ..fields.box import Box
from ..fields.registry import Node, get
from ..formulas import difference, infill, intersection, names, plane
from ..formulas.lattices import STRUTS
from ..work import Work
from . import with_depths
from .amount import sizing
from .extent import extent

if TYPE_CHECKING:
    from ..scene import Scene

WALLS = [name for name in names() if "grade" in get(name).parameters]
LATTICES = (*WALLS, *STRUTS)
"""What fills a solid: walls by the names of their formulas, struts by their kinds."""


def filled(
    scene: Scene,
    lattice: str,
    fraction: float,
    period: float,
    wall: float,
    size: float | None = None,
    work: Work | None = None,
) -> Scene:
    """Return the scene of a solid whose wall stays whole, and behind it a lattice.

    Parameters
    ----------
    scene
        The scene.
    lattice
        One of `LATTICES`.
    fraction
        Share of space that the lattice takes.
    period
        Length after which it repeats, mm.
    wall
        Thickness of the wall, mm.
    size
        Longest side of the object, if it is not the scene's, mm.
    work
        Execution settings.

    Raises
    ------
    SceneError
        For a value that the elements do not take.
    VolumeError
        For a solid without an end, or an empty one.
    """
    sized = sizing(scene, size, work=work)
    unit = sized.unit or sized.scale(_box(scene, work))
    formula, kind = (get(lattice), {}) if lattice in WALLS else (get("struts"), {"kind": lattice})
    filler = formula(period=period / unit, volume_fraction=fraction, **kind)
    return _of(scene, infill(scene.root, filler, shell=wall / unit), unit)


def cut(
    scene: Scene, axis: int, height: float, size: float | None = None, work: Work | None = None
) -> tuple[Scene, Scene]:
    """Return the scenes of what is below a plane and what is above it.

    Parameters
    ----------
    scene
        The scene.
    axis
        Axis across the plane, 0 to 2.
    height
        Where the plane is, mm: along z above the lowest point, along x and y from the middle of the box.
    size
        Longest side of the whole object, if it is not the scene's, mm.
    work
        Execution settings.

    Raises
    ------
    VolumeError
        If the plane misses the solid, or that is empty or without an end.
    """
    sized, box = sizing(scene, size, work=work), _box(scene, work)
    unit = sized.unit or sized.scale(box)
    origin = box.lo[2] if axis == 2 else box.centre[axis]  # as meshes are placed
    low, high = (unit * (corner[axis] - origin) for corner in (box.lo, box.hi))
    if not low < height < high:
        name = "xyz"[axis]
        raise VolumeError(
            f"the plane {name}={height:g}mm misses the solid: expected one from {low:.4g}mm to {high:.4g}mm"
        )
    half = plane(normal=[float(k == axis) for k in range(3)], offset=origin + height / unit)
    return _of(scene, intersection(scene.root, half), unit), _of(scene, difference(scene.root, half), unit)


def _box(scene: Scene, work: Work | None) -> Box:
    """Box that the solid reaches, scene units."""
    return extent(with_depths(scene.root, work), work).box


def _of(scene: Scene, root: Node, unit: float) -> Scene:
    """The scene with another solid, whose size follows from the unit."""
    return replace(scene, root=root, size_mm=None, unit_mm=unit)
