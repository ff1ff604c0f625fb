"""Samples fine enough to resolve connectivity, however thin the walls and gaps."""

from __future__ import annotations

from ..common.quantiles import weighted_quantiles
from ..errors import VolumeError
from ..formulas import Box
from ..kernel import Field, Kernel
from ..volume import Bricks, Lattice, sample
from ..volume.lattice import BRICK
from ..work import Work
from .samples import Samples
from .thin_features import thin_features
from .walls import Walls

FINEST = 768
"""Maximum number of samples along the longest side in the search for a surface."""

MOST = 150_000
"""Approximate maximum number of bricks in samples that resolve connectivity, for a field whose batches are of
the usual size; fewer if its values take longer.
"""

AGAIN = 3.0
"""Refinement factor for fractals that appear disconnected."""


def sampled_object(root: Field, outer: Box, longest: float, samples: float, work: Work) -> Bricks:
    """Sample an object, finer until a surface appears: a plate may lie between all samples.

    Parameters
    ----------
    root : Field
        The object.
    outer : Box
        Conservative bounds, scene units.
    longest : float
        Longest side, scene units.
    samples : float
        Samples along `longest`, doubled while no surface appears.
    work : Work
        Threads, progress and cancellation.

    Raises
    ------
    VolumeError
        If no surface appears in up to `FINEST` samples.
    Cancelled
        When the work is cancelled.
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
    """Resample an object finer if its samples may miss walls or gaps: two samples across the thinnest.

    A plate thicker than sqrt 3 samples is not pierced, whatever its tilt (Andres, Acharya and Sibata 1997,
    "Discrete analytical hyperplanes"). A fractal has walls of every thickness; it is resampled only if it
    appears disconnected.

    Parameters
    ----------
    root : Field
        The object.
    bricks : Bricks
        Its samples.
    least : float
        Area of thin walls and gaps from which finer samples are taken, squared scene units.
    loose : bool
        True if the samples appear disconnected.
    work : Work
        Threads, progress and cancellation.
    thin : Walls, optional
        Thin walls and gaps of the object, if known.

    Returns
    -------
    Bricks
        Finer samples, or `bricks`.

    Raises
    ------
    VolumeError
        If the field cannot be sampled.
    Cancelled
        When the work is cancelled.
    """
    times = AGAIN if loose else 1.0
    if not root.bounds.exterior_only:
        if thin is None:
            walls, gaps = thin_features(root, Samples(bricks), work)
            thin = walls.walls + gaps.walls
        times = _times(bricks, thin, least, MOST * root.kernel().batch / Kernel.batch)
    if times <= 1:
        return bricks
    lattice = Lattice.around(Samples(bricks).bounds.box, bricks.voxel / times)
    return sample(root.kernel(), root.bounds, lattice, work)


def _times(bricks: Bricks, thin: Walls, least: float, most: float) -> float:
    """Refinement factor for these walls and gaps, up to `most` bricks; 1 if fewer than `least` are thin."""
    voxel = bricks.voxel
    if thin.chosen(thin.width < 2 * voxel).area.sum() < least:
        return 1.0
    count = max(len(bricks), float(thin.area.sum()) / (BRICK * voxel) ** 2)
    (thinnest,) = weighted_quantiles(thin.width, thin.area, 0.01)
    return float(min(2 * voxel / thinnest, (most / count) ** 0.5))
