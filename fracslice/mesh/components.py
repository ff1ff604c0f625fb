"""Connected components of a mesh: bodies and the cavities inside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError


@dataclass(frozen=True)
class Removed:
    """Bodies and cavities that `choose` removes.

    Attributes
    ----------
    bodies : int
        Removed bodies. Those outside the part around the bodies that stay are never meshed, and not counted.
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
    shells: Shells, *, keep: int | None = None, dust_mm3: float = 0.0, cavities: str = "keep"
) -> tuple[NDArray[np.bool_], Removed]:
    """Choose bodies and cavities.

    A cavity is removed with its body, and a body inside a cavity with the filling.

    Parameters
    ----------
    shells : Shells
        All shells; volumes in mm3.
    keep : int, optional
        Number of the largest bodies that stay; all by default.
    dust_mm3 : float, optional
        Bodies of less volume are removed, mm3.
    cavities : {"keep", "fill"}, optional
        Keep or fill sealed cavities.

    Returns
    -------
    ndarray of bool, shape (s,)
        True for each shell that stays.
    Removed
        The components to remove.

    Raises
    ------
    MeshError
        If nothing would remain.
    ValueError
        For an unknown choice.
    """
    if cavities not in ("keep", "fill"):
        raise ValueError(f"no such choice: cavities={cavities!r}")
    hollow = shells.volumes < 0
    material = shells.volumes if cavities == "fill" else shells.solid_volumes
    stays = ~hollow & (material >= dust_mm3)
    if cavities == "fill":  # the filling absorbs bodies inside cavities
        stays &= shells.parent < 0
    if not stays.any():
        raise MeshError(f"nothing would be left: every body is smaller than {dust_mm3:g} mm3")
    if keep is not None:
        largest = np.argsort(np.where(stays, -material, 0), kind="stable")[:keep]
        stays &= np.isin(np.arange(len(stays)), largest)
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
