"""Connected components of a mesh: bodies and the cavities inside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fracslice.errors import MeshError
from fracslice.mesh.model import Mesh

PIECES = 0.05
"""Minimum fraction of the material in bodies thinner than a voxel for a note on thin walls."""


@dataclass(frozen=True)
class Removed:
    """Bodies and cavities that `select` removed.

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
    labels : ndarray of int32, shape (n,)
        Shell of each vertex.
    volumes : ndarray of float64, shape (s,)
        Signed volumes, negative for cavities.
    parent : ndarray of int64, shape (s,)
        Smallest shell around each: a body for a cavity, a cavity for a body, -1 for none.
    """

    labels: NDArray[np.int32]
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


def shells(mesh: Mesh, threads: int = 0) -> Shells:
    """Shells of a closed, oriented mesh: triangles connected by vertices, in O(m).

    Parameters
    ----------
    mesh : Mesh
        Closed, oriented mesh.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Shells
        The shells, numbered by their first vertices.

    Raises
    ------
    MeshError
        If a shell is inside out.
    """
    from fracslice.mesh.topology import component_sizes, connected_components

    labels, count = connected_components(mesh.triangles, len(mesh.vertices), threads)
    volumes = component_sizes(mesh.vertices, mesh.triangles, labels, count, threads).volumes
    hollow = volumes < 0
    parent = np.full(count, -1, dtype=np.int64)
    if hollow.any():
        from fracslice.mesh.nesting import nesting

        parent = nesting(mesh, labels, volumes, threads=threads).parent
        if (parent[hollow] < 0).any() or hollow[parent[hollow]].any():
            raise MeshError("a shell of the mesh is inside out: it looks inwards and no body is around it")
    return Shells(labels, volumes, parent)


def select(
    mesh: Mesh,
    *,
    keep: Literal["all", "largest"] = "all",
    dust_mm3: float = 0.0,
    cavities: Literal["keep", "fill"] = "keep",
) -> tuple[Mesh, Removed]:
    """Select bodies and cavities of a mesh.

    A cavity is removed with its body, and a body inside a cavity with the filling.

    Parameters
    ----------
    mesh : Mesh
        Closed, oriented mesh, mm.
    keep : {"all", "largest"}, optional
        Bodies to keep.
    dust_mm3 : float, optional
        Bodies of less volume are removed, mm3.
    cavities : {"keep", "fill"}, optional
        Keep or fill sealed cavities.

    Returns
    -------
    Mesh
        The remaining shells.
    Removed
        What was removed.

    Raises
    ------
    MeshError
        If nothing would remain or a shell is inside out.
    ValueError
        For an unknown choice.
    """
    found = shells(mesh)
    staying, removed = choose(found, keep=keep, dust_mm3=dust_mm3, cavities=cavities)
    return (mesh if staying.all() else mesh.selected(staying[found.labels[mesh.triangles[:, 0]]])), removed


def choose(
    found: Shells, *, keep: str = "all", dust_mm3: float = 0.0, cavities: str = "keep"
) -> tuple[NDArray[np.bool_], Removed]:
    """Shells that `select` keeps.

    Parameters
    ----------
    found : Shells
        All shells; volumes in mm3.
    keep, dust_mm3, cavities
        As in `select`.

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
    hollow = found.volumes < 0
    material = found.volumes if cavities == "fill" else found.solid_volumes
    stays = ~hollow & (material >= dust_mm3)
    if cavities == "fill":  # the filling absorbs bodies inside cavities
        stays &= found.parent < 0
    if not stays.any():
        raise MeshError(f"nothing would be left: every body is smaller than {dust_mm3:g} mm3")
    if keep == "largest":
        stays &= np.arange(len(stays)) == np.argmax(np.where(hollow, 0, material))
    lost = ~hollow & ~stays
    filled = hollow & stays[found.body] & (cavities == "fill")
    open_cavities = hollow & stays[found.body] & ~filled
    removed = Removed(
        bodies=int(lost.sum()),
        bodies_mm3=float(found.solid_volumes[lost].sum()),
        cavities=int((hollow & ~open_cavities).sum()),
        filled_mm3=float(np.abs(found.volumes[filled]).sum()),
    )
    return stays | open_cavities, removed
