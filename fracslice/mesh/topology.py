"""Topology of triangles: edges, fans around vertices, connected components, bodies and cavities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import component_sizes as _component_sizes
from .._native import edge_topology as _edge_topology
from ..errors import MeshError


class EdgeTopology(NamedTuple):
    """Counts of edges and vertices of a mesh; all but `edges` are zero for a closed, oriented 2-manifold."""

    edges: int  # edges
    open_edges: int  # edges of one triangle
    non_manifold_edges: int  # edges of more than two triangles
    misoriented_edges: int  # edges of two triangles that traverse them in the same direction
    non_manifold_vertices: int  # vertices that join several fans


def edge_topology(triangles: NDArray[np.int32], vertices: int, threads: int = 0) -> EdgeTopology:
    """Count open, non-manifold and misoriented edges, and non-manifold vertices.

    O(m), or O(m log d) at vertices of degree d.

    `triangles`: int32 (m, 3).
    """
    ends = edge_ends(triangles, np.ones(vertices, dtype=np.bool_), threads)
    edges, opened, non_manifold, misoriented = (n // 2 for n in ends[:4])
    return EdgeTopology(edges, opened, non_manifold, misoriented, ends.non_manifold_vertices)


def edge_ends(triangles: NDArray[np.int32], counted: NDArray[np.bool_], threads: int = 0) -> EdgeTopology:
    """Counts of `edge_topology` at some vertices; edges are counted by their ends.

    An edge with both ends at these vertices counts twice.

    `triangles`: int32 (m, 3); `counted`: bool (n,).
    """
    return EdgeTopology(*_edge_topology(triangles, counted, threads))


class Sizes(NamedTuple):
    """Sizes of connected components."""

    # signed volumes, measured from `outermost[:, 0]`, which keeps the precision of small components
    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]  # areas
    vectors: NDArray[np.float64]  # vector areas; zero for closed components
    outermost: NDArray[np.int32]  # first vertices farthest out along -x, -y, -z, x, y and z
    flat: NDArray[np.int64]  # triangles without area


def component_sizes(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    labels: NDArray[np.int32],
    count: int,
    threads: int = 0,
) -> Sizes:
    """Sizes of connected components.

    `vertices`: float64 (n, 3); `triangles`: int32 (m, 3); `labels`: int32 (n,).
    """
    return Sizes(*_component_sizes(vertices, triangles, labels, count, threads))


@dataclass(frozen=True)
class Removed:
    """Bodies and cavities that `choose` removes."""

    # removed bodies. Those outside the part around the bodies that stay are never meshed, and not counted
    bodies: int = 0
    bodies_mm3: float = 0.0  # their volume, mm3
    cavities: int = 0  # removed cavities
    filled_mm3: float = 0.0  # volume of the filled ones, mm3


@dataclass(frozen=True, eq=False)
class Shells:
    """Shells of a mesh: its connected closed surfaces."""

    volumes: NDArray[np.float64]  # signed volumes, negative for cavities
    # smallest shell around each: a body for a cavity, a cavity for a body, -1 for none
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

    `dust_mm3` in mm3. Returns bool (s,).
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
