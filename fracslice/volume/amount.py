"""Size and amount of an object: mm per scene unit, compensation of shrinkage, the direction up; its
volume estimated from the field, the sample spacing that resolves it, and what is lost.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import length, rotation
from ..common.messages import decimal
from ..errors import SliceError
from ..fields.box import Box, Triple, possible_cells
from ..fields.field import Bounds, Field, Kernel
from ..fields.node import Node
from ..records import DUST, SAME, UP
from ..work import Work, chunks
from . import Lattice, Plan, with_depths
from .bricks import values_at
from .extent import extent, reached

if TYPE_CHECKING:
    from ..scene import Scene


@dataclass(frozen=True)
class Sizing:
    """Size of an object."""

    side: float  # longest side before compensation, mm; approximate if `unit` is given
    unit: float | None = None  # mm per scene unit before compensation; None if `side` determines it
    factors: Triple = SAME  # compensation of shrinkage along x, y and z of the print

    @classmethod
    def of(cls, side: float | None, factors: Triple = SAME) -> Sizing:
        """Size of an object whose longest side is given, mm."""
        if side is None:
            raise SliceError("size: expected a length, for an object without a scene")
        return cls(side, None, factors)

    @property
    def longest(self) -> float:
        """Approximate longest side, mm."""
        return self.side * max(self.factors)

    @property
    def stretch(self) -> Triple:
        """Factors of the field along each axis, of which the largest is 1."""
        x, y, z = (factor / max(self.factors) for factor in self.factors)
        return x, y, z

    def scale(self, box: Box) -> float:
        """Scale of the stretched field.

        `box` in scene units. Returns mm per scene unit.
        """
        most = max(self.factors)
        if self.unit is not None:
            return self.unit * most
        return self.side * most / max(s / f for s, f in zip(box.size, self.stretch, strict=True))


def sizing(
    scene: Scene, size_mm: float | None = None, factors: Triple = SAME, work: Work | None = None
) -> Sizing:
    """Size of the object of a scene. A scene with a unit is measured.

    `size_mm` in mm.
    """
    side, unit = size_mm or scene.size_mm, None if size_mm else scene.unit_mm
    if side is None or unit is not None:
        assert unit is not None
        side = unit * max(extent(with_depths(scene.root, work), work).box.size)
    return Sizing(side, unit, factors)


def orient_field(root: Field, up: Triple, stretch: Triple = SAME, work: Work | None = None) -> Field:
    """Rotate a field by the shortest way so that a direction points along z, then stretch it.

    `up`: direction.
    """
    turn = _turn(up)
    if turn[3] == 0 and stretch == SAME:
        return root
    if root.tree is None:
        raise SliceError("up: expected a scene of formulas")
    from ..formulas import transform

    made = with_depths(root.tree, work)
    if turn[3]:
        made = transform(made, rotate=turn)
    return made if stretch == SAME else transform(made, scale=stretch)


def orientation(up: Triple, factors: Triple = SAME) -> NDArray[np.float64]:
    """Linear map of `orient_field`, for points.

    `up`: direction. Returns float64 (3, 3).
    """
    matrix: NDArray[np.float64] = (rotation(_turn(up)) * np.array(factors)[:, None]).T
    return matrix


def _turn(up: Triple) -> tuple[float, float, float, float]:
    """Axis and angle, degrees, of the shortest rotation of a direction to z."""
    direction = np.asarray(up, float) / length(np.asarray(up, float))
    axis = np.cross(direction, UP)
    angle = math.degrees(math.atan2(length(axis), float(direction[2])))
    x, y, z = axis.tolist() if length(axis) > 0 else (1.0, 0.0, 0.0)
    return x, y, z, angle


def box_of_the_rest(planned: Plan, whole: np.ndarray, rest: np.ndarray, tips: np.ndarray, work: Work) -> Box:
    """Return the bounds of the remaining components, from the field: a mesh does not contain all tips.

    `planned`: bounds and voxel size; `whole`, `rest`: [2, 3], scene units; `tips`: [n, 3], scene units.
    Returns `Box` in scene units.
    """
    if (rest == whole).all():
        return planned.box
    result = reached(planned.root, tips.T, planned.voxel, work)
    own = np.array([planned.box.lo, planned.box.hi])
    lo, hi = np.where(rest == whole, own, [result.lo, result.hi]).tolist()
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


POINTS = 1 << 18
"""Random points in all boxes."""

CELLS = 1 << 16
"""Largest number of cells in all boxes."""

MOST_EACH = 64
"""Largest number of random points per cell."""

AT_ONCE = 1 << 14
"""Approximate number of random points evaluated together."""

TOLERANCE = 0.01
"""Tolerated volume error of the samples, as a fraction of the object's volume."""

SURE = 3.0
"""Standard errors by which a difference is significant."""

SEEN = 1 << 11
"""Interior points tested to choose a sample spacing."""

FINER = 2, 4, 8, 16, 32
"""Refinement factors to choose from."""

SCATTERED = 0.5
"""Fraction of the points of an element without samples beside them from which it is lost."""

PARTS = 32
"""Largest number of elements that are looked for one by one."""

FEWEST, EACH = 8, 64
"""Number of interior points of an element below which it has random points of its own, and number tested."""

MARGIN = 1.5
"""Required ratio of wall thickness to sample spacing: below it, a slanted wall is sampled only here and
there.
"""


@dataclass(frozen=True, eq=False)
class VolumeEstimate:
    """Monte Carlo estimate of an object's volume."""

    volume: float  # volume, scene units^3
    error: float  # standard error of the volume, scene units^3
    # random points inside the object, float64 [3, n], scene units, in cells that are not proven full
    inside: np.ndarray

    def off(self, made: float) -> float:
        """Return the relative error of a reproduced volume.

        `made`: scene units^3.
        """
        sure = abs(made - self.volume) > max(SURE * self.error, TOLERANCE * self.volume)
        return made / self.volume - 1 if sure and self.volume else 0.0

    def some(self, count: int = SEEN) -> np.ndarray:
        """Interior points drawn at random, always the same ones, with repetitions, float64 [3, count]."""
        return self.inside[:, np.random.default_rng(1).integers(self.inside.shape[1], size=count)]


def amount(root: Field, boxes: list[Box], work: Work | None = None) -> VolumeEstimate:
    """Estimate the volume inside disjoint boxes by stratified random points with a fixed seed.

    Cells that are proven empty are skipped. Cells that are proven full are counted whole, where the field
    bounds distances inside too (Cochran 1977, "Sampling Techniques", chapter 5).

    `boxes` in scene units.
    """
    work, conservative = work or Work(), root.conservative()
    kernel, bound = root.kernel(), conservative.kernel()
    parts = [_part(kernel, bound, conservative.bounds, box, len(boxes), work) for box in boxes]
    return VolumeEstimate(
        sum(part.volume for part in parts),
        math.hypot(*(part.error for part in parts)),
        np.concatenate([part.inside for part in parts], axis=1),
    )


def _part(
    kernel: Kernel, conservative: Kernel, bounds: Bounds, box: Box, boxes: int, work: Work
) -> VolumeEstimate:
    """Estimate the volume inside one of `boxes` boxes."""
    cells, values, step = possible_cells(
        lambda p: values_at(conservative, p, work), bounds.lipschitz, box, CELLS // boxes
    )
    full = (values < -bounds.lipschitz * length(step) / 2) & (not bounds.exterior_only)
    cells, whole = cells[:, ~full], int(full.sum())
    each = min(max(POINTS // boxes // max(cells.shape[1], 1), 2), MOST_EACH)
    count, cell = cells.shape[1], float(step.prod())
    share = np.empty(count)

    def task(part: slice) -> np.ndarray:
        points = np.empty((3, part.stop - part.start, each))
        for axis, row in enumerate(points):  # numbers of one sequence, for any division of the cells
            numbers = np.random.Generator(np.random.PCG64(0).advance((axis * count + part.start) * each))
            row[:] = cells[axis, part, None] + step[axis] * numbers.uniform(-0.5, 0.5, row.shape)
        inside = kernel.points(*points) < 0
        share[part] = inside.mean(axis=1)
        return points[:, inside]

    pieces = work.collect(task, chunks(count, max(AT_ONCE // each, 1)))
    error = math.sqrt(float((share * (1 - share)).sum()) / (each - 1))
    inside = np.concatenate([np.empty((3, 0)), *pieces], axis=1)
    return VolumeEstimate(cell * (whole + float(share.sum())), cell * error, inside)


def finer(
    root: Field,
    estimate: VolumeEstimate,
    off: float,
    origin: tuple[float, float, float],
    spacing: tuple[float, float, float],
    work: Work | None = None,
) -> int | None:
    """Return the refinement factor of the samples that brings the volume error below the tolerance.

    The missing volume is proportional to the fraction of interior points whose eight surrounding samples are
    all outside. If that fraction is small, the error comes from faceting and is proportional to the square of
    the spacing.

    `origin`, `spacing` in scene units.
    """
    points = estimate.some()

    def lost(times: float) -> float:
        return lost_share(root, points, origin, spacing, times, work)

    now = lost(1)
    if now < abs(off) / 4:
        return next((times for times in FINER if abs(off) < TOLERANCE * times**2), None)
    return next((times for times in FINER if lost(times / MARGIN) * abs(off) < TOLERANCE * now), None)


def lost_share(
    root: Field,
    points: np.ndarray,
    origin: tuple[float, float, float],
    spacing: tuple[float, float, float],
    times: float = 1.0,
    work: Work | None = None,
) -> float:
    """Return the fraction of interior points whose eight surrounding samples are all outside.

    `points`: float64 [3, n], scene units.
    """
    step = np.array(spacing)[:, None, None] / times
    start = np.array(origin)[:, None, None]
    corners = np.indices((2, 2, 2)).reshape(3, 1, 8)
    samples = start + step * (np.floor((points[:, :, None] - start) / step) + corners)
    outside = values_at(root.kernel(), samples.reshape(3, -1), work or Work()) >= 0
    return float(outside.reshape(-1, 8).all(axis=1).mean())


def scattered(
    root: Field, estimate: VolumeEstimate, missed: Lacks, work: Work | None = None
) -> list[tuple[Node, np.ndarray, float]]:
    """Find the elements of a scene of several that are missed at most of their points.

    Returns such elements, points in them, float64 [3, n], scene units, and the share of these that is missed.
    """
    found = []
    for part in parts(root.tree) if root.tree else ():
        low, high = (np.array(corner)[:, None] for corner in (part.bounds.box.lo, part.bounds.box.hi))
        near = estimate.inside[:, ((estimate.inside >= low) & (estimate.inside <= high)).all(axis=0)]
        own = replace(estimate, inside=near[:, values_at(part.kernel(), near, work or Work()) < 0])
        if own.inside.shape[1] < FEWEST:
            own = amount(part, [part.bounds.box], work)
            if own.volume < DUST * estimate.volume or not own.inside.size:
                continue
        points = own.some(EACH)
        if (share := missed(points)) >= SCATTERED:
            found.append((part, points, share))
    return found


def parts(node: Node) -> list[Node]:
    """Elements of sharp unions, if they are at most `PARTS`."""
    if node.formula.name != "union" or node["smooth"]:
        return []
    children = [part for child in node.fields for part in parts(child) or [child]]
    return children if len(children) <= PARTS else []


SMALLEST_CAVITY = 27
"""Cells of the smallest cavity; smaller ones are noise of the grid."""


def count_sealed(root: Field, outer: Box, cell: float, work: Work) -> tuple[int, float]:
    """Count the components of the empty space that no outside cell reaches.

    `outer`, `cell` in scene units. Returns cubed scene units.
    """
    from scipy.ndimage import label

    counts = [int(np.ceil(side / cell)) for side in outer.size]
    x, y, z = (low + cell * (np.arange(n) + 0.5) for low, n in zip(outer.lo, counts, strict=True))
    kernel, empty = root.kernel(), np.ones([n + 2 for n in counts], bool)
    yy, zz = np.meshgrid(y, z, indexing="ij")
    for i, at in enumerate(x.tolist()):
        work.check()
        empty[i + 1, 1:-1, 1:-1] = kernel.points(np.full_like(yy, at), yy, zz) >= 0
    sizes = np.bincount(label(empty)[0].ravel())
    sizes = sizes[2:]  # after the solid and the outside
    kept = sizes[sizes >= SMALLEST_CAVITY]
    return len(kept), float(kept.sum()) * cell**3


Lacks = Callable[[np.ndarray], float]
"""Share of points, float64 [3, n], scene units, that are missing."""

Grid = tuple[Triple, Triple, Callable[[float], str]]
"""Origin and spacing of the samples, scene units, and a function that names samples of a fraction of the
spacing.
"""

LOST = 0.05
"""Share of an object's volume without which it is no success."""

RAISED = 2, 4
"""Refinements of the samples that a job tries by itself."""


@dataclass(frozen=True)
class Amount:
    """Volumes of the object and of its mesh or layers, mm3."""

    object: float  # volume of the object, estimated from its field at random points
    error: float  # standard error of that estimate
    made: float  # volume of the mesh or the layers
    off: float  # relative difference if it is significant, else 0

    @property
    def missing(self) -> float:
        """Share of the object's volume that is missing; 0 if that is not significant."""
        return -min(self.off, 0.0) + 0.0

    @property
    def lost(self) -> bool:
        """True if more than `LOST` of the object is missing, whatever the error of its estimate."""
        return self.missing > 0 and self.missing - SURE * self.error / self.object > LOST


class Completeness(NamedTuple):
    """What of an object is not in its mesh or layers."""

    amount: Amount  # both volumes
    notes: tuple[str, ...] = ()  # volume that is missing or too much, as text
    # the same where the object is lost: more than `LOST` of it, or a whole element of the scene
    problems: tuple[str, ...] = ()
    # refinement of the samples after which it is probably not lost, of `RAISED`; 1 if there is no need or
    # none suffices
    cure: int = 1


def lost_size(
    name: str, box: Sequence[float], made: Sequence[float], whole: Sequence[float], spacing: Sequence[float]
) -> tuple[Triple, tuple[str, ...]]:
    """Compare the size of a mesh or layers with that of the object.

    `box`, `made`, `whole` (with the bodies that were removed), `spacing` in mm. Returns the length that is
    missing along each axis, mm, and a note on it if it is more than a sample.
    """
    x, y, z = lost = [max(of - own, 0.0) for of, own in zip(box, made, strict=True)]
    samples = [mm / step for mm, step in zip(lost, spacing, strict=True)]
    axis = samples.index(max(samples))
    if samples[axis] <= 1:
        return (x, y, z), ()
    removed = whole[axis] - made[axis] > lost[axis] / 2
    reason = "bodies that were removed" if removed else "tips or walls finer than the samples"
    along = f"{name} {decimal(made[axis])} mm of {decimal(box[axis])} mm along {'xyz'[axis]}"
    return (x, y, z), (f"{along}: {reason} reach farther",)


def mesh_amount(
    planned: Plan, made: float, scale: float, whole: bool, work: Work, lacks: Lacks | None = None
) -> Completeness:
    """Compare the volume of a mesh with that of its field.

    `made` in mm3; `scale`: mm per scene unit; `lacks`: share of points that the mesh lacks, if samples
    do not tell.
    """
    lattice = Lattice.around(planned.outer, planned.voxel)

    def sampling(voxel: float) -> str:
        return f"a voxel of {voxel * planned.voxel * scale:.2g} mm"

    spacing = planned.voxel, planned.voxel, planned.voxel
    grid = lattice.origin, spacing, sampling
    return compare_volumes(planned.root, [planned.outer], made, scale, grid, whole, work, lacks)


def compare_volumes(
    root: Field,
    boxes: list[Box],
    made: float,
    scale: float,
    grid: Grid,
    whole: bool,
    work: Work,
    lacks: Lacks | None = None,
) -> Completeness:
    """Compare the volume of the field in boxes, scene units, with `made`, mm3; with `whole`, look for the
    elements of the scene, too. `lacks` as for `mesh_amount`.
    """
    true, (origin, spacing, name) = amount(root, boxes, work), grid
    off, unit = true.off(made / scale**3), scale**3
    compared = Amount(true.volume * unit, true.error * unit, made, off)

    def missed(points: np.ndarray, times: float = 1.0) -> float:
        return lost_share(root, points, origin, spacing, times, work)

    def would(times: int | None) -> str:
        return (
            f"{name(1 / times)} would show it" if times else f"{name(1 / FINER[-1])} would not show it either"
        )

    notes, problems, cures = list[str](), list[str](), [1]
    for part, points, share in scattered(root, true, lacks or missed, work) if whole else ():
        times = next((t for t in FINER if missed(points, t / MARGIN) < SCATTERED), None)
        element = f"<{part.formula.name}>{of(part)}"
        problems.append(f"{share:.0%} of {element} is finer than the samples and missing: {would(times)}")
        cures.append(next((t for t in RAISED if missed(points, t) < SCATTERED), 0))
    if off > 0:
        notes.append(f"{off:.1%} more volume than the object has: the samples are too coarse for it")
    if off < 0:
        text = f"{-off:.1%} of the object's volume is finer than the samples and missing"
        (problems if compared.lost else notes).append(
            f"{text}: {would(finer(root, true, off, origin, spacing, work))}"
        )
    if compared.lost:
        points = true.some()
        most = LOST * missed(points) / -off
        cures.append(next((t for t in RAISED if missed(points, t) < most), 0))
    return Completeness(compared, tuple(notes), tuple(problems), max(cures) if all(cures) else 1)


def of(part: Node) -> str:
    """Where an element was read, if it was."""
    return f" of {part.place}" if part.place else ""
