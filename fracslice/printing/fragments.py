"""Fragments into which the voxels of a mesh break bodies with necks about as thin as a voxel."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .bridges import NONE, bridging_struts
from .solid_components import SolidComponents

CRUMB = 8
"""Samples below which a fragment is a broken tip, if a larger one is near: a cube of two voxels."""

NEAR = 2
"""Distance of a tip from a larger fragment, samples along each axis."""


def fragments(
    meshed: SolidComponents, known: SolidComponents | None
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Tips that break off, and struts that join the other fragments of each body.

    Parameters
    ----------
    meshed : SolidComponents
        Components of the samples of the mesh.
    known : SolidComponents or None
        Components of samples that resolve connectivity; None for a single body.

    Returns
    -------
    tips, others : int64 [k], int64 [n]
        Bodies of `meshed` that are broken tips, and the rest.
    struts : tuple of float64 [m, 3]
        Starts and ends, scene units.
    """
    bodies = meshed.bodies
    owner = _owners(meshed, known)[bodies] if known else np.zeros(len(bodies), np.int64)
    tip = meshed.count[bodies] < CRUMB
    group = np.full(len(meshed.inside), NONE)
    group[bodies[~tip]] = owner[~tip]
    near = _beside(meshed, bodies[tip], group)
    tip[tip] = [own != NONE and own in groups for own, groups in zip(owner[tip], near, strict=True)]
    loose = ~tip & (owner != NONE)
    return bodies[tip], bodies[~tip], bridging_struts(meshed, bodies[loose], owner[loose])


def _beside(meshed: SolidComponents, bodies: np.ndarray, group: np.ndarray) -> Iterator[np.ndarray]:
    """Groups of the components near each body."""
    place = meshed.places(bodies)
    cube = np.indices((2 * NEAR + 1,) * 3).reshape(3, -1).T - NEAR
    near = group[meshed.at((place[:, None] + cube).reshape(-1, 3))].reshape(len(place), len(cube))
    of = meshed.at(place)
    for body in bodies:
        yield near[of == body]


def _owners(meshed: SolidComponents, known: SolidComponents) -> np.ndarray:
    """Body of `known` in which each body of `meshed` lies, int64 [m]; NONE if in none."""
    place = meshed.places(meshed.bodies)
    points = np.array(meshed.solid.origin) + meshed.solid.voxel * place
    theirs = known.at(np.round((points - known.solid.origin) / known.solid.voxel).astype(np.int64))
    within, result = known.inside[theirs], np.full(len(meshed.inside), NONE)
    result[meshed.at(place[within])] = theirs[within]
    return result
