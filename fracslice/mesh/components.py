"""Connected components of a mesh: bodies and the cavities inside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fracslice.errors import MeshError

PIECES = 0.05
"""Minimum fraction of the material in bodies thinner than a voxel for a note on thin walls."""


@dataclass(frozen=True)
class Removed:
    """Bodies and cavities that `choose` removes.

    Attributes
    ----------
    bodies : int
        Removed bodies.
    bodies_mm3 : float
        Their volume, mm3.
    cavities : int
        Removed cavities.
    filled_mm3 : float
        Volume of the filled ones, mm3.
    """

    bodies: int = 0
    bodies_mm3: float = 0.0
    cavities: int = 0
    filled_mm3: float = 0.0


@dataclass(frozen=True, eq=False)
class Shells:
    """Shells of a mesh: its connected closed surfaces.

    Attributes
    ----------
    volumes : ndarray of float64, shape (s,)
        Signed volumes, negative for cavities.
    parent : ndarray of int64, shape (s,)
        Smallest shell around each: a body for a cavity, a cavity for a body, -1 for none.
    """

    volumes: NDArray[np.float64]
    parent: NDArray[np.int64]

    @property
    def body(self) -> NDArray[np.int64]:
        """Outer shell of each shell, int64 [s]: the shell itself, or for a cavity the body around it."""
        return np.where(self.volumes < 0, self.parent, np.arange(len(self.volumes)))

    @property
    def solid_volumes(self) -> NDArray[np.float64]:
        """Volume of material of each body without its cavities, float64 [s]; zero for cavities."""
        volumes = np.zeros(len(self.volumes))
        np.add.at(volumes, self.body, self.volumes)
        return volumes


def choose(
    shells: Shells, *, keep: str = "all", dust_mm3: float = 0.0, cavities: str = "keep"
) -> tuple[NDArray[np.bool_], Removed]:
    """Choose bodies and cavities.

    A cavity is removed with its body, and a body inside a cavity with the filling.

    Parameters
    ----------
    shells : Shells
        All shells; volumes in mm3.
    keep : {"all", "largest"}, optional
        Bodies to keep.
    dust_mm3 : float, optional
        Bodies of less volume are removed, mm3.
    cavities : {"keep", "fill"}, optional
        Keep or fill sealed cavities.

    Returns
    -------
    ndarray of bool, shape (s,)
        True for each shell that stays.
    Removed
        What is removed.

    Raises
    ------
    MeshError
        If nothing would remain.
    ValueError
        For an unknown choice.
    """
    if keep not in ("all", "largest") or cavities not in ("keep", "fill"):
        raise ValueError(f"no such choice: keep={keep!r}, cavities={cavities!r}")
    hollow = shells.volumes < 0
    material = shells.volumes if cavities == "fill" else shells.solid_volumes
    stays = ~hollow & (material >= dust_mm3)
    if cavities == "fill":  # the filling absorbs bodies inside cavities
        stays &= shells.parent < 0
    if not stays.any():
        raise MeshError(f"nothing would be left: every body is smaller than {dust_mm3:g} mm3")
    if keep == "largest":
        stays &= np.arange(len(stays)) == np.argmax(np.where(hollow, 0, material))
    lost = ~hollow & ~stays
    filled = hollow & stays[shells.body] & (cavities == "fill")
    open_cavities = hollow & stays[shells.body] & ~filled
    removed = Removed(
        bodies=int(lost.sum()),
        bodies_mm3=float(shells.solid_volumes[lost].sum()),
        cavities=int((hollow & ~open_cavities).sum()),
        filled_mm3=float(np.abs(shells.volumes[filled]).sum()),
    )
    return stays | open_cavities, removed
