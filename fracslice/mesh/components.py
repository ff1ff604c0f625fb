"""The bodies of a mesh and the cavities inside them: keep, drop, fill."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fracslice.errors import MeshError
from fracslice.mesh.model import Mesh

PIECES = 0.05
"""The share of the material in bodies thinner than a voxel from which that is said."""


@dataclass(frozen=True)
class Removed:
    """What `select` took away: bodies and their volume, cavities and the volume of those that were filled."""

    bodies: int = 0
    bodies_mm3: float = 0.0
    cavities: int = 0
    filled_mm3: float = 0.0


@dataclass(frozen=True, eq=False)
class Shells:
    """The connected closed surfaces of a mesh.

    labels: int32 [m], the shell of each triangle; volumes: float64 [s], signed, negative for a cavity;
    parent: int64 [s], the smallest shell around each: a body for a cavity, a cavity for a body, -1 for none.
    """

    labels: NDArray[np.int32]
    volumes: NDArray[np.float64]
    parent: NDArray[np.int64]

    @property
    def body(self) -> NDArray[np.int64]:
        """The outer shell that each belongs to: itself, or for a cavity the body around it. int64 [s]."""
        return np.where(self.volumes < 0, self.parent, np.arange(len(self.volumes)))

    @property
    def solid_volumes(self) -> NDArray[np.float64]:
        """Volume of material of each shell's body, cavities taken off; zero at cavities. float64 [s]."""
        volumes = np.zeros(len(self.volumes))
        np.add.at(volumes, self.body, self.volumes)
        return volumes


def shells(mesh: Mesh, threads: int = 0) -> Shells:
    """Find the shells of a closed, oriented mesh: triangles that share vertices, O(m)."""
    from fracslice.mesh.topology import component_sizes, connected_components

    labels, count = connected_components(mesh.triangles, len(mesh.vertices), threads)
    volumes, _ = component_sizes(mesh.vertices, mesh.triangles, labels, count, threads)
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
    """Keep all bodies or the largest, drop dust of less than `dust_mm3`, keep or fill sealed cavities.

    A cavity goes with its body, and a body in a cavity with the filling. Raises MeshError when nothing would
    be left, or the mesh has a shell that is inside out.
    """
    found = shells(mesh)
    staying, removed = choose(found, keep=keep, dust_mm3=dust_mm3, cavities=cavities)
    return (mesh if staying.all() else mesh.selected(staying[found.labels])), removed


def choose(
    found: Shells, *, keep: str = "all", dust_mm3: float = 0.0, cavities: str = "keep"
) -> tuple[NDArray[np.bool_], Removed]:
    """Which shells `select` would keep, bool [s]. Raises as it does."""
    if keep not in ("all", "largest") or cavities not in ("keep", "fill"):
        raise ValueError(f"no such choice: keep={keep!r}, cavities={cavities!r}")
    hollow = found.volumes < 0
    material = found.volumes if cavities == "fill" else found.solid_volumes
    stays = ~hollow & (material >= dust_mm3)
    if cavities == "fill":  # what floats in a cavity is swallowed
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
