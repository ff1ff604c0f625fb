"""Arrays: quantiles, records of arrays, linear algebra, triangles with shared vertices, sRGB, other
libraries.

Linear algebra libraries choose the summation order and fused operations by processor. With them, a rotated
scene would have other parameters, and its mesh other last bits, on another machine.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from .parameters import Triple

if TYPE_CHECKING:
    import trimesh


def quantile(values: np.ndarray, share: float) -> float:
    """Return a quantile, interpolated linearly between neighbours in rank."""
    rank = (values.size - 1) * share
    low = min(math.floor(rank), max(values.size - 2, 0))
    high = min(low + 1, values.size - 1)
    ordered = np.partition(values, [low, high, values.size - 1], axis=None)
    if math.isnan(ordered[-1]):
        return math.nan
    return float(ordered[low] + (ordered[high] - ordered[low]) * (rank - low))


def distinct(numbers: np.ndarray) -> np.ndarray:
    """Sort integers and remove duplicates.

    `numpy.unique` takes five to 25 times as long: it hashes before it sorts. So do NumPy's unions,
    intersections and differences of sets. Returns [m], of the same type.
    """
    ordered = np.sort(numbers, axis=None)
    fresh = np.ones(len(ordered), bool)
    fresh[1:] = ordered[1:] != ordered[:-1]
    return np.asarray(ordered[fresh])


def weighted_quantiles(values: np.ndarray, weights: np.ndarray, *shares: float) -> list[float]:
    """Return values below which these shares of the weight lie."""
    order = np.argsort(values, kind="stable")
    upto = np.cumsum(weights[order])
    at = np.searchsorted(upto, np.array(shares) * upto[-1])
    quantiles: list[float] = values[order][np.minimum(at, len(values) - 1)].tolist()
    return quantiles


class Rows:
    """Base of dataclasses whose fields are all arrays with one row per item, [n, ...]."""

    def chosen(self, which: np.ndarray | slice) -> Self:
        """Select rows.

        `which`: bool [n].
        """
        return type(self)(*(values[which] for values in vars(self).values()))

    def __add__(self, more: Self) -> Self:
        """Append the rows of another record."""
        return type(self).joined([self, more])

    @classmethod
    def joined(cls, records: Sequence[Self]) -> Self:
        """Concatenate records."""
        arrays = zip(*(vars(record).values() for record in records), strict=True)
        return cls(*(np.concatenate(some) for some in arrays))


def to_linear(shown: NDArray[Any]) -> NDArray[Any]:
    """Convert display values to linear light."""
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def from_linear(light: NDArray[Any]) -> NDArray[Any]:
    """Convert linear light to display values."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def on_host(given: Any) -> np.ndarray:
    """Array of NumPy or of another library, by DLPack, without a copy. Raises BufferError for a GPU's."""
    if isinstance(given, np.ndarray) or not hasattr(given, "__dlpack__"):
        return np.asarray(given)
    try:
        return np.from_dlpack(given)
    except (BufferError, RuntimeError, TypeError):
        raise BufferError("expected an array in the memory of the CPU, of numbers that NumPy has") from None


def of_library(values: np.ndarray, given: Any) -> Any:
    """Values as an array of the library of another one, such as PyTorch, where it takes them by DLPack."""
    if isinstance(given, np.ndarray) or not hasattr(given, "__dlpack__"):
        return values
    library = sys.modules[type(given).__module__.partition(".")[0]]
    return library.from_dlpack(values) if hasattr(library, "from_dlpack") else values


SWEEPS = 60
SMALL = 2.0**-52


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Matrix product.

    `a`: matrix; `b`: matrix or vector.
    """
    # transposed, as most are tall: NumPy's inner loop is along the last axis
    terms = [np.multiply.outer(b[k], np.ascontiguousarray(a[:, k])) for k in range(a.shape[1])]
    total: np.ndarray = terms[0]
    for term in terms[1:]:
        total += term
    return np.ascontiguousarray(total.T)


def dot(a: np.ndarray, b: np.ndarray) -> float:
    """Inner product of two vectors of equal length."""
    return _dot(a.tolist(), b.tolist())


def _dot(a: list[float], b: list[float]) -> float:
    total = 0.0
    for x, y in zip(a, b, strict=True):
        total += x * y
    return total


def length(vector: np.ndarray) -> float:
    """Euclidean norm of a vector."""
    return math.sqrt(dot(vector, vector))


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse by Gauss-Jordan elimination with partial pivoting."""
    rows = np.hstack([np.asarray(matrix, float), np.eye(3)])
    for k in range(3):
        pivot = k + int(np.abs(rows[k:, k]).argmax())
        rows[[k, pivot]] = rows[[pivot, k]]
        rows[k] = rows[k] / rows[k, k]
        for other in {0, 1, 2} - {k}:
            rows[other] = rows[other] - rows[other, k] * rows[k]
    return rows[:, 3:]


def stretches(matrix: np.ndarray) -> np.ndarray:
    """Singular values, in descending order.

    One-sided Jacobi rotations make the columns orthogonal (Hestenes 1958, "Inversion of matrices by
    biorthogonalization and related results").
    """
    columns = np.array(matrix, float).T.tolist()
    for _ in range(SWEEPS):
        turned = False
        for p, q in ((0, 1), (0, 2), (1, 2)):
            one, other = columns[p], columns[q]
            a, b, both = _dot(one, one), _dot(other, other), _dot(one, other)
            if abs(both) <= SMALL * math.sqrt(a * b):
                continue
            half = (b - a) / (2 * both)
            tangent = math.copysign(1 / (abs(half) + math.sqrt(1 + half * half)), half)
            cosine = 1 / math.sqrt(1 + tangent * tangent)
            sine = cosine * tangent
            columns[p] = [cosine * x - sine * y for x, y in zip(one, other, strict=True)]
            columns[q] = [sine * x + cosine * y for x, y in zip(one, other, strict=True)]
            turned = True
        if not turned:
            break
    return np.sort([math.sqrt(_dot(column, column)) for column in columns])[::-1]


def rotation(rotate: Sequence[float]) -> np.ndarray:
    """Rotation matrix of an axis and an angle in degrees, by Rodrigues' formula."""
    axis = np.array(rotate[:3]) / length(np.array(rotate[:3]))
    angle = math.radians(rotate[3])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn: np.ndarray = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * product(cross, cross)
    return turn


def affine(values: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Affine map of a `transform`: of its rotation, scale, translation and matrix.

    Returns float64.
    """
    linear = np.zeros((3, 3))
    linear.flat[::4] = values["scale"]
    if values["rotate"]:
        linear = product(rotation(values["rotate"]), linear)
    offset = np.array(values["translate"])
    if values["matrix"]:
        given = np.array(values["matrix"][:12]).reshape(3, 4)
        offset = offset + product(linear, given[:, 3])
        linear = product(linear, given[:, :3])
    return linear, offset


@dataclass(frozen=True, eq=False)
class Filaments:
    """Filaments of which triangles are printed."""

    colours: NDArray[np.uint8]  # of the filaments, sRGB, (k, 3)
    of: NDArray[np.uint8]  # filament of the largest part of each triangle, (m,)
    texts: tuple[str, ...]  # how triangles are painted, as slicers store it
    text: NDArray[np.int32]  # number of the text of each triangle, (m,)
    bodies: tuple[Triangles, ...] = ()  # the solid of each filament, if they are wanted


@dataclass(frozen=True, eq=False, repr=False)
class Triangles:
    """Triangles as they are in a file. `Mesh` adds measures and checks of the arrays."""

    vertices: NDArray[np.float64]  # positions, (n, 3)
    triangles: NDArray[np.int32]  # vertex indices, (m, 3), counter-clockwise seen from outside
    colours: NDArray[np.uint8] | None = None  # of the vertices, sRGB, (n, 3)
    scalars: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)  # of the vertices, (n,)
    filaments: Filaments | None = None  # of the triangles
    tops: NDArray[np.float64] | None = None  # upper faces of layers that are advised, above the lowest point
    supported: NDArray[np.bool_] | None = None  # triangles at which supports are advised, (m,)

    @property
    def _arrays(self) -> tuple[Any, ...]:
        """Values of the fields."""
        hints = self.filaments, self.tops, self.supported
        return self.vertices, self.triangles, self.colours, dict(self.scalars), *hints

    def in_order(self) -> Triangles:
        """Sort the vertices by their first use, so that the triangles alone determine the arrays."""
        from .._native import in_order

        return self._taken(*in_order(self.triangles, len(self.vertices)))

    def _taken(self, index: NDArray[Any], triangles: NDArray[np.int32]) -> Triangles:
        """Triangles of some of the vertices, with colours and scalars; with filaments, if none is left out.

        `index`: int (k,), of the vertices; `triangles`: int32 (m, 3), of their numbers among these.
        """
        colours = None if self.colours is None else self.colours[index]
        scalars = {name: values[index] for name, values in self.scalars.items()}
        same = len(triangles) == len(self.triangles)
        hints = (self.filaments, self.tops, self.supported) if same else (None, self.tops, None)
        return Triangles(self.vertices[index], triangles, colours, scalars, *hints)

    def thumbnail(self) -> bytes | None:
        """Draw a small picture; `Mesh` does.

        Returns
        -------
        bytes or None
            A PNG file; None if nothing draws one.
        """
        return None

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


GREY = 200, 200, 196
"""Colour of what has none beside what has one, sRGB."""


def concatenate(parts: Sequence[T]) -> T:
    """Concatenate triangles without welding and scalars, with colours if any have them."""
    offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    triangles = [part.triangles + np.int32(offset) for part, offset in zip(parts, offsets, strict=True)]
    whole = np.concatenate([part.vertices for part in parts]), np.concatenate(triangles)
    if all(part.colours is None for part in parts):
        return type(parts[0])(*whole)
    colours = [_shown(part) if part.colours is None else part.colours for part in parts]
    return type(parts[0])(*whole, np.concatenate(colours))


def _shown(part: Triangles) -> NDArray[np.uint8]:
    """Colours of vertices that have none."""
    return np.full((len(part.vertices), 3), GREY, np.uint8)


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
    return Triangles(vertices, part.triangles[:, ::order], part.colours)


DEEPEST, MOST_PARTS = 32, 1 << 16
"""Limits for a file that places parts: levels of nesting, and number of nodes, parts and their uses."""

LARGEST, COPIES = 1 << 21, 64
"""Vertices, triangles and parts that it may make, and how many times those of the file. A few lines could ask
for any number.
"""


def triple(array: NDArray[np.float64]) -> Triple:
    """Three numbers of an array."""
    x, y, z = array.tolist()
    return x, y, z
