"""Grids of OpenVDB as solids of scenes: numbers to level sets, and solids to the files of other programs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.arrays import on_host
from ..common.cache import Kept, cache_folder, key
from ..common.files import replacing, temporary_folder
from ..common.parameters import Choice, Count, Number, Vector, short_repr, validate_value
from ..errors import VolumeError
from ..expr.language import InMemory
from ..fields.box import Box
from ..fields.registry import Node, get
from .bricks import Bricks, to_grid, write_grid
from .sampler import sample_scene

if TYPE_CHECKING:
    from .._vdb import Grid
    from ..work import Work
    from . import Plan

Kind = Literal["surface", "density"]
KINDS: tuple[Kind, Kind] = ("surface", "density")
"""What the numbers of a grid are, and the names that programs give such grids."""
FOG = "fog volume"
"""OpenVDB's class of a grid of densities."""
ISO = {"surface": 0.0, "density": 0.5}
"""Values at the surface: that of distances, and half of what OpenVDB's densities have inside."""
BEYOND = 4.0
"""Distance beyond an array, voxels."""
MOST = 1 << 27
"""Most numbers of an array."""


@dataclass(frozen=True, eq=False)
class LevelSet(InMemory):
    """Grid whose signed distances machine code asks for; see `native/volume/level_set.h`."""

    box: Box  # bounds of the inside
    tips: NDArray[np.float64] | None  # outermost points, as `Field.tips`, of a grid that is not turned
    slope: float  # by which the distances of `native` are divided, so that their L is 1


@lru_cache(maxsize=8)
def level_set(
    file: str, sha256: str, grid: str, kind: Kind | Literal["as stated"], iso: float | None
) -> LevelSet:
    """Level set of a grid of a file with a hash, in units of the file."""
    from .._vdb import LevelSet as Native

    found = _chosen(file, grid)
    as_named: Kind = "density" if found.kind == FOG or found.name == "density" else "surface"
    what = as_named if kind == "as stated" else kind
    level = ISO[what] if iso is None else iso
    try:
        native = Native(_around_zero(found, what, level))
    except ValueError as error:
        raise VolumeError(f"its grid {found.name!r} {error}") from None
    (x, y, z), (u, v, w) = native.box
    digest = int(key("level set", sha256, found.name, what, level)[:16], 16)
    ends = native.tips
    tips = None if ends is None else np.array(ends).T
    return LevelSet(digest, native, Box((x, y, z), (u, v, w)), tips, native.steepness)


def _around_zero(grid: Grid, kind: Kind, level: float) -> Grid:
    """Numbers that are 0 at the surface and negative inside; those of densities are made distances."""
    numbers = grid.less(level, kind == "density").with_cubes()
    return numbers.narrow_band() if kind == "density" else numbers


def _chosen(file: str, name: str) -> Grid:
    """Grid of a file: that of a name, or of the name that programs give to solids, or the only one."""
    from .._vdb import Grid, grids_of

    try:
        known = grids_of(file)
        usual = next((usual for usual in KINDS if usual in known), "")
        listed = ", ".join(known) or "none"
        if name and name not in known:
            raise VolumeError(f"no grid {name!r}; its grids are {listed}")
        if not (name or usual) and len(known) != 1:
            raise VolumeError(f"expected the name of one of its grids; they are {listed}")
        return Grid.read(file, name or usual)
    except RuntimeError as error:
        raise VolumeError(str(error).removeprefix(f"{file}: ")) from None


def from_vdb(
    path: str | os.PathLike[str],
    grid: str = "",
    *,
    kind: Kind | Literal["as stated"] = "as stated",
    iso: float | None = None,
    size: float | None = None,
    place: Literal["as is", "centre", "bed"] = "as is",
    units: Literal["um", "mm", "cm", "in", "m"] = "mm",
) -> Node:
    """Make a shape of a grid of an OpenVDB file, the element `<volume>` of scenes.

    Parameters
    ----------
    path : str or path
        The file.
    grid : str
        Name of a grid; by default surface or density, or the only one.
    kind : {"as stated", "surface", "density"}
        Whether numbers are signed distances, negative inside, or densities; as stated: what its class says.
    iso : float, optional
        Value at the surface; by default 0 of a surface, and 0.5 of a density.
    size : float, optional
        Longest side, scene units; by default a scene unit is a millimetre of the grid.
    place : {"as is", "centre", "bed"}
        As for `from_grid`.
    units : {"um", "mm", "cm", "in", "m"}
        Unit of the file.

    Returns
    -------
    Node

    Raises
    ------
    SceneError
        For a file that cannot be read, or a grid without a surface.
    """
    made: Node = get("volume")(
        os.fspath(path), grid=grid, kind=kind, iso=iso, size=size, place=place, units=units
    )
    made.bounds  # noqa: B018
    return made


def from_grid(
    array: ArrayLike,
    spacing: float | Sequence[float] = 1.0,
    *,
    iso: float | None = None,
    kind: Kind | None = None,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    size: float | None = None,
    place: Literal["as is", "centre", "bed"] = "as is",
) -> Node:
    """Make a shape of an array of numbers, such as a scan, a simulation or samples of a function.

    The numbers become a level set, in a file of the cache that the formula `volume` reads.

    Parameters
    ----------
    array : array_like [nx, ny, nz]
        Numbers or booleans; `array[i, j, k]` is at `origin + spacing * (i, j, k)`. All beyond it is outside.
    spacing : float or three floats
        Distance between samples, scene units.
    iso : float, optional
        Value at the surface: by default 0 of a surface, and halfway from the least to the largest density.
    kind : {"surface", "density"}, optional
        Whether numbers are negative inside, or larger than `iso`. By default numbers of both signs, positive
        at all sides of the array, are a surface. Distances stay as they are; others become distances.
    origin : three floats
        Where the first number is, scene units.
    size : float, optional
        Longest side of the solid, scene units; that of its samples by default.
    place : {"as is", "centre", "bed"}
        Where it is: as given, with the centre of its box at the origin, or with that above the origin and its
        lowest point at z = 0.

    Returns
    -------
    Node

    Raises
    ------
    VolumeError
        For an array of other dimensions, without a surface, or with a number that is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from fracslice import from_grid
    >>> x, y, z = np.indices((21, 21, 21)) - 10
    >>> ball = from_grid(np.sqrt(x * x + y * y + z * z) - 8, 0.5, place="centre")
    >>> ball.bounds.box.size
    (8.0, 8.0, 8.0)
    """
    from .._vdb import Grid

    values = _numbers(array)
    steps = tuple(np.broadcast_to(validate_value("spacing", spacing, _SPACING, VolumeError), 3).tolist())
    start = validate_value("origin", origin, Vector(None, ""), VolumeError)
    low, high = float(values.min()), float(values.max())
    what = validate_value("kind", kind or _kind(values), Choice(None, "", KINDS), VolumeError)
    level = (0.0 if what == "surface" else (low + high) / 2) if iso is None else iso
    level = validate_value("iso", level, Number(None, ""), VolumeError)
    if not low < level < high:
        raise VolumeError(f"iso={level:g}: expected a value between {low:g} and {high:g}, those of the array")
    beyond = level + BEYOND * max(steps) if what == "surface" else low

    def made() -> Grid:
        return _around_zero(Grid.from_array(values, start, steps, beyond), what, level)

    return _kept(key(values, steps, start, what, level), made, size, place)


def _kept(name: str, make: Callable[[], Grid], size: float | None, place: str) -> Node:
    """Shape of a grid in the cache, which is made if it is not there."""
    from .._vdb import level_set_of

    folder = Kept(cache_folder() / "volumes").place()
    if folder is None:
        raise VolumeError(f"{cache_folder()}: expected a folder that others cannot write in, for the samples")
    path = folder / f"{name}.vdb"
    if not path.exists():
        try:
            save(level_set_of(make()), path)
        except ValueError as error:
            raise VolumeError(f"the array {error}") from None
    return get("volume")(str(path), size=size, place=place)


SIDE, FIRST, COARSE, LARGEST = 192, 1.0, 33, 2.0**20
"""Samples of a function along its longest side; half the first cube that is searched for its inside, samples
of a cube along each side, and half of the largest one.
"""
MARGIN = 3
"""Samples around what a function has inside."""

Function = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], ArrayLike]


def from_function(
    function: Function,
    bounds: tuple[Sequence[float], Sequence[float]] | None = None,
    *,
    samples: int = SIDE,
) -> Node:
    """Make a shape of a function of NumPy, by its samples on a grid.

    A formula (`fracslice.formulas.shape`) is not sampled: it is compiled, and exact.

    Parameters
    ----------
    function : callable
        Function of arrays x, y and z, float64 of one shape, that returns numbers of that shape: negative
        inside. They need not be distances.
    bounds : two triples, optional
        Opposite corners of a box around the solid, scene units. By default it is searched for around the
        origin, in cubes that double from a side of 2.
    samples : int
        Samples along the longest side of the box.

    Returns
    -------
    Node

    Raises
    ------
    VolumeError
        If the function returns anything else, or has no inside, or one without end.

    Examples
    --------
    >>> from fracslice import from_function
    >>> egg = from_function(lambda x, y, z: x**2 + y**2 + (0.7 * z) ** 2 - 1, samples=64)
    >>> [round(side, 2) for side in egg.bounds.box.size]
    [2.0, 2.0, 2.86]
    """
    count = validate_value("samples", samples, Count(None, "", 8, 512), VolumeError)
    low, high = _searched(function) if bounds is None else _corners(bounds)
    step = float((high - low).max()) / (count - 1)
    start = low - MARGIN * step
    sides = [np.arange(math.ceil(size / step) + 1 + 2 * MARGIN) for size in (high - low).tolist()]
    values = _sampled(
        function, [first + step * side for first, side in zip(start.tolist(), sides, strict=True)]
    )
    return from_grid(values, step, kind="surface", origin=start.tolist())


def _corners(bounds: object) -> NDArray[np.float64]:
    """Opposite corners of a box, [2, 3]."""
    try:
        corners = np.array(bounds, np.float64).reshape(2, 3)
    except (TypeError, ValueError):
        corners = np.full((2, 3), np.nan)
    if not (np.isfinite(corners).all() and (corners[0] < corners[1]).all()):
        raise VolumeError("bounds: expected two corners of a box, such as ((-1, -1, -1), (1, 1, 1))")
    return corners


def _searched(function: Function) -> NDArray[np.float64]:
    """Corners of a box around the inside of a function."""
    half = FIRST
    while half <= LARGEST:
        side = np.linspace(-half, half, COARSE)
        inside = _sampled(function, [side] * 3) < 0
        edge = any(np.take(inside, end, axis).any() for axis in range(3) for end in (0, -1))
        if inside.any() and not edge:
            step, at = side[1] - side[0], np.argwhere(inside)
            return np.stack([side[at.min(0)] - step, side[at.max(0)] + step])
        half *= 2
    raise VolumeError("the function has no inside near the origin, or one without end; expected bounds")


def _sampled(function: Function, axes: Sequence[NDArray[np.float64]]) -> NDArray[np.float32]:
    """Values of a function on a grid, a few planes at once."""
    shape = tuple(map(len, axes))
    values = np.empty(shape, np.float32)
    planes = max(1, POINTS // (shape[1] * shape[2]))
    for first in range(0, shape[0], planes):
        points = np.meshgrid(axes[0][first : first + planes], *axes[1:], indexing="ij")
        try:
            found = np.asarray(function(*points), np.float64)
        except (TypeError, ValueError) as error:
            raise VolumeError(f"the function takes no arrays of x, y and z: {short_repr(error)}") from None
        if found.shape not in (points[0].shape, ()) or np.isnan(found).any():
            raise VolumeError("the function: expected a number for each point, in an array of the shape of x")
        values[first : first + planes] = np.clip(found, -FARTHEST, FARTHEST)
    return values


POINTS, FARTHEST = 1 << 20, 1e30
"""Points that a function is asked for at once, and largest value that is kept."""


def from_bricks(bricks: Bricks) -> Node:
    """Make a shape of the samples of a mesh; see `from_grid`."""
    values = key(bricks.origin, bricks.voxel, bricks.ijk, bricks.values, bricks.index)
    return _kept(values, lambda: to_grid(bricks), None, "as is")


_SPACING = Vector(None, "", above=0, sizes=(1, 3))


def _numbers(array: ArrayLike) -> NDArray[np.float32]:
    """Numbers as C-contiguous float32, checked."""
    try:
        given = on_host(array)
    except BufferError as error:
        raise VolumeError(str(error)) from None
    if given.ndim != 3 or given.dtype.kind not in "biuf" or not 0 < given.size <= MOST:
        found = f"{given.dtype} of shape {list(given.shape)}"
        raise VolumeError(f"expected an array of at most {MOST:,} numbers [nx, ny, nz], found {found}")
    values = np.ascontiguousarray(given, np.float32)
    if not np.isfinite(values).all():
        raise VolumeError("the array holds numbers that are not finite, or too large for float32")
    return values


def _kind(values: NDArray[np.float32]) -> Kind:
    """What numbers look like: distances are positive far from the solid."""
    sides = (np.take(values, end, axis).min() for axis in range(3) for end in (0, -1))
    return "surface" if values.min() < 0 < min(sides) else "density"


def solid_grid(planned: Plan, scale: float, kind: Kind, work: Work | None = None) -> Grid:
    """Grid of a planned scene, named for its kind: distances in a narrow band, or densities from 0 to 1.

    `scale`: length of a scene unit in the grid.
    """
    bricks = sample_scene(planned, work)
    x, y, z = (scale * c for c in bricks.origin)
    placed = replace(bricks, origin=(x, y, z), voxel=scale * bricks.voxel)
    return grid_of(placed, kind)


def grid_of(bricks: Bricks, kind: Kind = "surface") -> Grid:
    """Grid of samples, named for its kind: distances in a narrow band, or densities from 0 to 1."""
    try:
        grid = to_grid(bricks).narrow_band()
        grid = grid.fog() if kind == "density" else grid
    except ValueError as error:
        raise VolumeError(f"the grid of the samples {error}") from None
    grid.name = kind
    return grid


def save(grid: Grid, path: str | os.PathLike[str], metadata: Mapping[str, str] | None = None) -> None:
    """Write a grid to a .vdb file, which appears whole or not at all; equal grids give equal bytes."""
    with temporary_folder() as folder, replacing(Path(path)) as file:
        whole = folder / "grid.vdb"
        write_grid(grid, whole, metadata)
        file.write(whole.read_bytes())
