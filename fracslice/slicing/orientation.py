"""Directions up in which an object prints best: coarse layers of its samples, turned.

The object is sampled once. For each direction, the nearest samples make layers as thick as they are apart.
What a layer adds beyond 45 degrees to the one below needs supports, which reach down to the plate; the
largest layer pulls most at the film; hollows that are shut while they are printed, or afterwards, keep resin.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..fields.box import Triple
from ..fields.field import Field
from ..printing.pillars import CARRIED, LIFT
from ..printing.walls import Samples, edge_crossings
from ..records import Placed
from ..volume import Bricks, plan, sample_scene
from ..volume.amount import Sizing, orientation, sizing
from ..volume.bricks import BRICK, INSIDE
from ..work import Work
from .feature_graph import Graph, Runs, layer_components

if TYPE_CHECKING:
    from ..scene import Scene

SAMPLES = 64
"""Samples along the longest side."""

TRIED, FACES = 64, 16
"""Directions that are spread evenly, and sides of the convex hull that are put on the plate, the largest
first.
"""

BEST = 5
"""Directions that are refined and returned."""

STEPS = 0.2, 0.1, 0.05
"""Angles by which directions are turned to refine them, radians."""

APART = math.cos(math.radians(15))
"""Largest cosine between two of the best directions."""

GENTLE, STEEP = 0.6, 0.8
"""Share by which a surface looks down from which on it is carried, and from which on all of it is."""

DENSITY = 0.08
"""Cross-section of pillars for each mm2 that they carry."""

WEIGHTS = {"supports": 0.5, "scars": 0.2, "height": 0.05, "peel": 0.05, "trapped": 0.2}
"""What figures x weigh, as x / (x + their mean over all directions)."""


@dataclass(frozen=True)
class Orientation:
    """A direction up, and what the object is like in it."""

    up: Triple  # direction of the object that is up in the print
    supports: float  # estimated volume of supports, mm3
    scars: float  # area of the surface that they carry, mm2
    height: float  # mm
    peel: float  # largest cross-section, mm2
    trapped: float  # volume of suction cups and resin traps, mm3
    score: float = math.inf  # weighted sum of all, the less the better


def orientations(root: Field, size: Sizing, work: Work | None = None) -> list[Orientation]:
    """Find the best directions up of an object, the best first.

    Parameters
    ----------
    root : Field
        The object.
    size : Sizing
        Its size.
    work : Work, optional
        Threads, progress and cancellation.

    Returns
    -------
    list of Orientation
        At most five, at least 15 degrees apart.

    Raises
    ------
    VolumeError
        For a scene without a solid.
    Cancelled
        When the work is cancelled.
    """
    work = work or Work()
    planned = plan(root, SAMPLES, work)
    bricks = sample_scene(planned, work)
    turned = _Turned.of(bricks, bricks.voxel * size.scale(planned.box))
    first = [turned.look(up) for up in _directions(turned.surface)]
    means = {name: float(np.mean([getattr(one, name) for one in first])) or 1.0 for name in WEIGHTS}

    def scored(one: Orientation) -> Orientation:
        values = ((weight, getattr(one, name), means[name]) for name, weight in WEIGHTS.items())
        return replace(one, score=round(sum(w * value / (value + mean) for w, value, mean in values), 9))

    chosen = list[Orientation]()
    for one in sorted(map(scored, first), key=_rank):
        work.check()
        if len(chosen) == BEST:
            break
        if _is_apart(one, chosen):
            refined = _refined(turned, one, scored)
            chosen.append(refined if _is_apart(refined, chosen) else one)
        work.progress("turning", len(chosen) / BEST)
    return sorted(chosen, key=_rank)


def best_up(scene: Scene, placed: Placed, work: Work | None = None) -> Triple:
    """Find the best direction up of a scene, for a job with its size and scale."""
    return orientations(scene.root, sizing(scene, placed.size, placed.scale, work), work)[0].up


def _rank(one: Orientation) -> tuple[float, Triple]:
    return one.score, one.up


def _is_apart(one: Orientation, others: list[Orientation]) -> bool:
    return all(float(np.dot(one.up, other.up)) < APART for other in others)


def _refined(turned: _Turned, best: Orientation, scored: Callable[[Orientation], Orientation]) -> Orientation:
    """The best direction near another one, by pattern search."""
    for step in STEPS:
        across = orientation(best.up).T[:2]
        for side in (*across, *-across):
            up = np.array(best.up) * math.cos(step) + side * math.sin(step)
            one = scored(turned.look(up))
            if one.score < best.score:
                best = one
                break
    return best


def _directions(points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Unit vectors: the axes, a Fibonacci sphere, and those that put large sides of the hull on the plate."""
    from scipy.spatial import ConvexHull

    k = np.arange(TRIED) + 0.5
    z, turn = 1 - 2 * k / TRIED, math.pi * (1 + math.sqrt(5)) * k
    spread = np.column_stack([np.cos(turn) * np.sqrt(1 - z * z), np.sin(turn) * np.sqrt(1 - z * z), z])
    hull = ConvexHull(points)
    corners = hull.points[hull.simplices]
    sizes = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    sides, which = np.unique(np.round(hull.equations[:, :3], 1), axis=0, return_inverse=True)
    total = np.bincount(which.reshape(-1), sizes)
    largest = np.argsort(-total, kind="stable")[:FACES]
    outwards = np.stack(
        [np.bincount(which.reshape(-1), sizes * axis) for axis in hull.equations[:, :3].T], 1
    )[largest]
    down = outwards / np.linalg.norm(outwards, axis=1)[:, None]
    return [*np.eye(3), *-np.eye(3), *-down, *spread]


@dataclass(frozen=True, eq=False)
class _Turned:
    """Samples of an object that are turned."""

    full: NDArray[np.uint8]  # 1 inside, [x, y, z]
    surface: NDArray[np.float64]  # points of the surface, samples, [n, 3]
    area: NDArray[np.float64]  # of the surface around them, square samples, [n]
    normals: NDArray[np.float64]  # [n, 3]
    step: float  # distance of samples, mm

    @classmethod
    def of(cls, bricks: Bricks, step: float) -> _Turned:
        """Samples a `step` apart."""
        shape = np.array(bricks.index.shape) * BRICK
        full = np.repeat(np.repeat(np.repeat(bricks.index == INSIDE, BRICK, 0), BRICK, 1), BRICK, 2)
        full = full.astype(np.uint8)
        inside = (bricks.values < 0).reshape(-1, BRICK, BRICK, BRICK)
        for (x, y, z), values in zip(bricks.ijk.tolist(), inside, strict=True):
            full[x : x + BRICK, y : y + BRICK, z : z + BRICK] = values
        points, normals, area = edge_crossings(Samples(bricks), np.arange(len(bricks)))
        assert full.shape == tuple(shape)
        return cls(full, (points - bricks.origin) / bricks.voxel, area / bricks.voxel**2, normals, step)

    def look(self, up: NDArray[np.float64]) -> Orientation:
        """Figures of the object with a direction up."""
        up = up / np.linalg.norm(up)
        full = self.layers(up)
        step, square = self.step, self.step**2
        height = self.surface @ up
        low, high = float(height.min()), float(height.max())
        steep = self.normals @ up
        peel = float(full.sum((1, 2)).max()) * square
        # without a foot that carries it, all of it stands on pillars
        lift = LIFT / step if float(full[0].sum()) * square * CARRIED < peel else 0.0
        held = self.area * np.interp(-steep, (GENTLE, STEEP), (0, 1)) * ((height > low + 1.5) | (lift > 0))
        falls = held * -steep * (height - low + lift)
        foot = peel / CARRIED * LIFT if lift else 0.0
        solid, empty = Graph(), Graph()
        for layer in full:
            now, gaps = layer_components(_runs(layer))
            solid.add(now)
            empty.add(gaps)
        begun = solid.islands()
        bottoms = float((solid.layer[begun] * 3.0).sum())  # a pillar for each, of about 3 mm2 carried
        shut = empty.shut(False) | empty.shut(True)
        deep = float(empty.nodes.area[shut & (empty.nodes.area > 4)].sum())
        return Orientation(
            up=(rounded(up[0]), rounded(up[1]), rounded(up[2])),
            supports=DENSITY * (float(falls.sum()) * step**3 + bottoms * step) + foot,
            scars=float(held.sum()) * square + float(begun.sum()) * 0.1,
            height=(high - low + lift) * step,
            peel=peel,
            trapped=deep * step**3,
        )

    def layers(self, up: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Samples of layers, [z, y, x], with a margin of empty ones."""
        from scipy.ndimage import affine_transform

        turn = orientation((float(up[0]), float(up[1]), float(up[2]))).T  # rows: x, y and z of the print
        placed = self.surface @ turn.T
        low = np.floor(placed.min(0)) - 1
        shape = (np.ceil(placed.max(0)) - low + 2).astype(int)
        back = turn.T[:, ::-1]
        offset = turn.T @ low
        made = affine_transform(self.full, back, offset, tuple(shape[::-1].tolist()), order=0)
        filled = np.flatnonzero(made.any((1, 2)))
        return np.asarray(made[filled[0] : filled[-1] + 1])


def _runs(layer: NDArray[np.uint8]) -> Runs:
    """Runs of a layer."""
    steps = np.diff(np.pad(layer.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    rows, begin = np.nonzero(steps > 0)
    end = np.nonzero(steps < 0)[1]
    limits = np.searchsorted(rows, np.arange(len(layer) + 1))
    return Runs(limits.astype(np.int32), begin.astype(np.int32), end.astype(np.int32), layer.shape[1])


def rounded(number: float) -> float:
    """A number of four digits."""
    return float(f"{number:.4f}") + 0.0
