"""Triangles with shared vertices: what a file of a mesh holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False, repr=False)
class Triangles:
    """Triangles as they are in a file. `Mesh` adds measures and checks of the arrays."""

    vertices: NDArray[np.float64]  # positions, (n, 3)
    triangles: NDArray[np.int32]  # vertex indices, (m, 3), counter-clockwise seen from outside
    colours: NDArray[np.uint8] | None = None  # of the vertices, sRGB, (n, 3)
    scalars: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)  # of the vertices, (n,)

    @property
    def _arrays(self) -> tuple[Any, ...]:
        """Values of the fields."""
        return self.vertices, self.triangles, self.colours, dict(self.scalars)

    def in_order(self) -> Triangles:
        """Sort the vertices by their first use, so that the triangles alone determine the arrays."""
        from .._native import in_order

        return self._taken(*in_order(self.triangles, len(self.vertices)))

    def _taken(self, index: NDArray[Any], triangles: NDArray[np.int32]) -> Triangles:
        """Triangles of some of the vertices, with their colours and scalars.

        `index`: int (k,), of the vertices; `triangles`: int32 (m, 3), of their numbers among these.
        """
        colours = None if self.colours is None else self.colours[index]
        scalars = {name: values[index] for name, values in self.scalars.items()}
        return Triangles(self.vertices[index], triangles, colours, scalars)

    def to_trimesh(self) -> trimesh.Trimesh:
        """Copy of the mesh as a `trimesh.Trimesh`, unprocessed.

        Returns
        -------
        trimesh.Trimesh
            The same vertices and triangles; colours and, as vertex attributes, scalars.
        """
        import trimesh

        return trimesh.Trimesh(
            self.vertices.copy(),
            self.triangles.copy(),
            process=False,
            vertex_colors=None if self.colours is None else self.colours.copy(),
            vertex_attributes={name: values.copy() for name, values in self.scalars.items()},
        )


T = TypeVar("T", bound=Triangles)

NO_TRIANGLES = Triangles(np.empty((0, 3)), np.empty((0, 3), np.int32))


def concatenate(parts: Sequence[T]) -> T:
    """Concatenate triangles without welding, and without colours and scalars."""
    offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    triangles = [part.triangles + np.int32(offset) for part, offset in zip(parts, offsets, strict=True)]
    return type(parts[0])(np.concatenate([part.vertices for part in parts]), np.concatenate(triangles))


def count(part: Triangles) -> int:
    """Number of vertices and triangles."""
    return len(part.vertices) + len(part.triangles)


def fans(lengths: NDArray[np.integer], corners: NDArray[np.int32]) -> NDArray[np.int32]:
    """Triangles of polygons, each from its first corner.

    `lengths`: number of corners of each polygon. Returns int32 (m, 3).
    """
    lengths = lengths.astype(np.int64)
    triangles = np.maximum(lengths - 2, 0)
    first = np.repeat(np.cumsum(lengths) - lengths, triangles)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    result: NDArray[np.int32] = corners[np.stack([first, second, second + 1], axis=1)]
    return result


def moved(part: Triangles, vertices: NDArray[np.float64], matrix: NDArray[np.float64]) -> Triangles:
    """Triangles with the vertices that a transform gives them; a mirror image is turned inside out again.

    `matrix`: its linear part, (3, 3).
    """
    order = -1 if np.linalg.det(matrix) < 0 else 1
    return Triangles(vertices, part.triangles[:, ::order])


DEEPEST, MOST_PARTS = 32, 1 << 16
"""Limits for a file that places parts: levels of nesting, and number of nodes, parts and their uses."""

LARGEST, COPIES = 1 << 21, 64
"""Vertices, triangles and parts that it may make, and how many times those of the file. A few lines could ask
for any number.
"""
