"""Samples that tell what is connected, however thin the walls and the gaps."""

from __future__ import annotations

import numpy as np

from ..errors import VolumeError
from ..formulas import Box
from ..kernel import Field
from ..volume import Bricks, Lattice, sample
from ..volume.lattice import BRICK
from ..work import Work
from .samples import Samples
from .thin_features import thin_features
from .walls import Walls

FINEST = 768
"""Samples along the longest side where fewer show nothing at all."""

MOST = 150_000
"""Bricks of samples to tell what is connected, about."""

AGAIN = 3.0
"""How many times finer fractals are looked at that seem to be in pieces."""


def shown(root: Field, outer: Box, longest: float, samples: float, work: Work) -> Bricks:
    """Samples of an object within the box `outer`, so many along `longest`, or more if those show nothing: a
    plate may lie between all of them. Raises `VolumeError`, `Cancelled`.
    """
    while True:
        try:
            return sample(root.kernel(), root.bounds, Lattice.around(outer, longest / samples), work)
        except VolumeError:
            samples *= 2
            if samples > FINEST:
                raise


def resolved(
    root: Field, bricks: Bricks, least: float, loose: bool, work: Work, thin: Walls | None = None
) -> Bricks:
    """These samples of an object, or finer ones if it has walls or gaps that they may miss: two across the
    thinnest. A plate thicker than sqrt 3 samples is not pierced, whatever its tilt (Andres, Acharya and
    Sibata 1997, "Discrete analytical hyperplanes").

    least: the area from which such walls and gaps count, scene units. thin: those, if they are known. A
    fractal has them at every scale; it is looked at again only if it seems to be in pieces, `loose`. Raises
    `VolumeError`, `Cancelled`.
    """
    times = AGAIN if loose else 1.0
    if not root.bounds.exterior_only:
        if thin is None:
            walls, gaps = thin_features(root, Samples(bricks), work)
            thin = walls.walls + gaps.walls
        times = _times(bricks, thin, least)
    if times <= 1:
        return bricks
    lattice = Lattice.around(Samples(bricks).bounds.box, bricks.voxel / times)
    return sample(root.kernel(), root.bounds, lattice, work)


def _times(bricks: Bricks, thin: Walls, least: float) -> float:
    """How many times finer to look."""
    voxel = bricks.voxel
    if thin.chosen(thin.width < 2 * voxel).area.sum() < least:
        return 1.0
    count = max(len(bricks), float(thin.area.sum()) / (BRICK * voxel) ** 2)
    return float(min(2 * voxel / _thinnest(thin), (MOST / count) ** 0.5))


def _thinnest(found: Walls) -> float:
    """The width that a hundredth of the surface is under."""
    order = np.argsort(found.width, kind="stable")
    upto = np.cumsum(found.area[order])
    return float(found.width[order][np.searchsorted(upto, 0.01 * upto[-1])])
