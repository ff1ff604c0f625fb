"""Triangle models: read from files, welded like in a slicer, nothing repaired; as solids of scenes, with
their hashes, checks and signed distances; and as fields.
"""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from .. import _native
from ..common.cache import Kept, cache_folder, key
from ..common.files import open_regular
from ..errors import MeshError, SceneError
from ..expr.language import InMemory
from ..fields.box import Box
from ..fields.devices import ArrayField
from ..fields.field import Bounds, Device, Kernel, Precision, outermost
from ..fields.node import TriangleMesh
from ..fields.registry import Node, get
from ..formats import ENDINGS, MeshFormat, mesh_format
from .checks import MeshReport, check_mesh
from .cleaning import quantise_mesh
from .model import Mesh, build

MOST, MOST_BYTES = 1 << 21, 1 << 27
"""Most triangles of a solid, and bytes of a file that is no format of meshes."""
MOST_AROUND = 1 << 13
"""Most triangles around a vertex, as each is compared with each."""
CHUNK = 1 << 20
"""Bytes that are hashed at once."""


def read_mesh(path: str | Path) -> Mesh:
    """Read a mesh file, in mm.

    STL, PLY and OBJ have no unit: mm are assumed. Coordinates are rounded to float32, equal positions welded,
    and every triangle is kept.

    Returns `Mesh` in mm.
    """

    def welded(form: MeshFormat, file: Path) -> Mesh:
        whole = form.read(file)
        return quantise_mesh(Mesh(whole.vertices, whole.triangles))

    mesh = _read(Path(path), welded)
    most = np.bincount(mesh.triangles.ravel()).max()
    if most > MOST_AROUND:
        raise MeshError(
            f"{path}: {most} corners of triangles meet at a vertex: expected at most {MOST_AROUND}"
        )
    return mesh


def read_coloured(path: str | Path) -> Mesh:
    """Read a mesh file with the colours of its vertices, for windows and pictures; nothing is welded.

    Returns `Mesh` in mm.
    """

    def whole(form: MeshFormat, file: Path) -> Mesh:
        made = (form.read_coloured or form.read)(file)
        return Mesh(made.vertices, made.triangles, made.colours)

    mesh = _read(Path(path), whole)
    return mesh if mesh.colours is not None else read_mesh(path)


def _read(path: Path, make: Callable[[MeshFormat, Path], Mesh]) -> Mesh:
    """Mesh of a file, by the reader of its format."""
    if (ending := path.suffix.lower()) not in ENDINGS:
        raise MeshError(f"{path}: not a model file that can be read; known are {', '.join(ENDINGS)}")
    try:
        if path.is_file() and not path.stat().st_size:
            raise MeshError("the file is empty")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of NumPy: coordinates that are not finite are refused
            mesh = make(mesh_format(ending), path)
    except FileNotFoundError:
        raise MeshError(f"{path}: no such file") from None
    except (OSError, MeshError) as error:
        raise MeshError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    if not len(mesh.triangles):
        raise MeshError(f"{path}: the file has no triangles")
    return mesh


@dataclass(frozen=True, eq=False)
class Solid(InMemory):
    """Closed mesh whose signed distances machine code asks for; see `native/mesh/solid.h`."""

    box: Box  # bounds
    mesh: Mesh | None = None  # its triangles, if they are a printable mesh

    @classmethod
    def of(cls, mesh: Mesh, printable: bool = False) -> Solid:
        """Solid of a checked mesh; `printable`: whether it is more than a solid, a printable mesh."""
        vertices, triangles = mesh.vertices, mesh.triangles
        # Triangles that are near each other lie together in memory.
        order, *boxes = build(mesh, halved=True)
        mesh = Mesh(vertices, triangles[order]).in_order()
        native = _native.Solid(mesh.vertices, mesh.triangles, np.arange(len(order)), *boxes)
        low, high = mesh.bounds.tolist()
        digest = int(key("solid", vertices, triangles)[:16], 16)
        return cls(
            digest, native, Box(tuple(low), tuple(high)), Mesh(vertices, triangles) if printable else None
        )


def identify(file: str, digest: str | None, known: Iterable[str], what: str) -> tuple[str, str]:
    """Return the whole path of a file and the SHA-256 of its contents; `known`: extensions it may have.

    A file whose model is in memory is not looked at once more.
    """
    path = os.path.abspath(file)
    if os.path.splitext(path)[1].lower() not in known:
        raise MeshError(f"not {what} that can be read; known are {', '.join(sorted(known))}")
    if digest is None or (path, digest) not in _SEEN:
        found = file_hash(path)
        if digest not in (None, found):
            raise MeshError(f"the file is another now: expected one with the hash {digest}")
        _SEEN.add((path, found))
        return path, found
    return path, digest


_SEEN = set[tuple[str, str]]()
"""Files that had these hashes."""


def file_hash(path: str) -> str:
    """SHA-256 of a file."""
    try:
        with open_regular(path) as file:
            ending = os.path.splitext(path)[1].lower()
            most = mesh_format(ending).most if ending in ENDINGS else MOST_BYTES
            if (size := os.fstat(file.fileno()).st_size) > most:
                large = f"a file of {size / 1e6:.0f} MB: expected at most {most / 1e6:.0f} MB"
                raise MeshError(f"{large}, of fewer triangles or samples, or in a binary format")
            digest = hashlib.sha256()
            while data := file.read(CHUNK):
                digest.update(data)
            return digest.hexdigest()
    except FileNotFoundError:
        raise MeshError("no such file") from None
    except OSError as error:
        raise MeshError(error.strerror or str(error)) from None


def require_unchanged(file: str, sha256: str) -> None:
    """Raise the error about a file that has another hash since it was identified."""
    if file_hash(file) != sha256:
        raise MeshError("the file was changed while it was read")


def from_trimesh(
    mesh: TriangleMesh, *, size: float | None = None, place: Literal["as is", "centre", "bed"] = "as is"
) -> Node:
    """Make a shape of a triangle mesh.

    Its triangles, with coordinates rounded to float32, are kept in a file of the cache, which the formula
    `model` reads. For a scene file that lasts, export the mesh beside it.

    Parameters
    ----------
    mesh : trimesh.Trimesh or Mesh
        A closed mesh without self-intersections; any object with `vertices` [n, 3] and `faces` [m, 3].
    size : float, optional
        Longest side, scene units; that of the mesh by default.
    place : {"as is", "centre", "bed"}
        Where it is: as given, with the centre of its box at the origin, or with that above the origin and its
        lowest point at z = 0.

    Returns
    -------
    Node

    Raises
    ------
    MeshError
        If the mesh encloses no solid, or the cache cannot be written.

    Examples
    --------
    >>> import trimesh
    >>> from fracslice import from_trimesh, gyroid
    >>> block = from_trimesh(trimesh.creation.box((10, 10, 10)))
    >>> float(block.distance([0, 0, 8]))
    3.0
    >>> (block & gyroid(period=4)).bounds.box.size
    (10.0, 10.0, 10.0)
    """
    given = Mesh(np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int32))
    folder = Kept(cache_folder() / "models").place()
    if folder is None:
        raise MeshError(f"{cache_folder()}: expected a folder that others cannot write in, for the triangles")
    path = folder / f"{key(given.vertices, given.triangles)}.ply"
    if not path.exists():
        given.export(path)
    made = get("model")(str(path), size=size, place=place)
    try:
        made.bounds  # noqa: B018
    except SceneError as error:
        raise MeshError(str(error.__cause__).partition(";")[0]) from None
    return made


def faults(report: MeshReport) -> tuple[str, ...]:
    """Faults by which a mesh is no solid: it may touch itself at vertices, and triangles may be an edge."""
    return replace(report, nonmanifold_vertices=0, degenerate_triangles=0).problems


@lru_cache(maxsize=8)
def solid(file: str, sha256: str) -> Solid:
    """Solid of a model file with a hash, in mm; refused if it encloses none."""
    try:
        mesh = read_mesh(file)
    except MeshError as error:
        raise MeshError(str(error).removeprefix(f"{file}: ")) from None
    require_unchanged(file, sha256)
    if len(mesh.triangles) > MOST:
        raise MeshError(f"{len(mesh.triangles):,} triangles: expected at most {MOST:,}")
    report = check_mesh(mesh)
    if problems := faults(report):
        mended = f"`fracslice repair {os.path.basename(file)} -o OUT` mends what it can"
        raise MeshError(f"{', '.join(problems)}: expected a solid; {mended}")
    a, b, c = mesh.triangles.T
    return Solid.of(mesh.selected((a != b) & (b != c) & (c != a)), not report.problems)


@dataclass(frozen=True, eq=False)
class MeshField(ArrayField):
    """Distance to a mesh, negative where the mesh winds around a point: bodies that overlap are united."""

    mesh: Mesh  # A closed mesh; its unit is the scene unit

    @cached_property
    def bounds(self) -> Bounds:
        """`Field.bounds`."""
        low, high = self.mesh.vertices.min(0).tolist(), self.mesh.vertices.max(0).tolist()
        return Bounds(Box(tuple(low), tuple(high)), 1.0, False)

    @property
    def tips(self) -> np.ndarray:
        """`Field.tips`."""
        return outermost(self.mesh.vertices)

    @cached_property
    def key(self) -> str:
        """`Field.key`."""
        return key("mesh", self.mesh.vertices, self.mesh.triangles)

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`, always on the CPU."""
        return _MeshKernel(self, np.dtype(precision))

    @cached_property
    def native(self) -> _native.MeshField:
        """Evaluator of the field."""
        return _native.MeshField(self.mesh.vertices, self.mesh.triangles, *build(self.mesh, halved=True))


class _MeshKernel(Kernel):
    """Kernel of a mesh."""

    batch = 1 << 14

    def __init__(self, field: MeshField, dtype: np.dtype) -> None:
        self._native, self.dtype = field.native, dtype

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        u, v, w = (np.asarray(a, np.float64).reshape(-1) for a in (x, y, z))
        values = self._native.points(u, v, w)
        return values.reshape(np.shape(x)).astype(self.dtype, copy=False)

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """`Kernel.bricks`."""
        if out.dtype == np.float32:
            out[:] = self._native.bricks(corners, origin, voxel)
        else:
            super().bricks(corners, origin, voxel, out)
