"""The public calls: signed distances, meshes, layers, pictures and OpenVDB files of shapes and scenes."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, Unpack, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.arrays import of_library, on_host
from ..common.files import check_target, replacing
from ..common.messages import format_count, lacking
from ..common.parameters import AUTO, AnyLength, Choice, items, validate_value
from ..errors import ExportError, FracsliceError, SceneError, SliceError, TooLargeError
from ..formulas import Node
from ..jobs.mesh import make_mesh as make_mesh_job
from ..jobs.pictures import make_picture
from ..jobs.report import Result
from ..records import MeshJob, RenderJob
from ..scene import Print, Scene
from ..scene.model import element_to_xml
from ..scene.view import Camera, Film, Light, View
from ..slicing import Contours, Layer, SliceJob, Slicer, Stack, plan_layers
from ..version import APPLICATION
from ..volume import plan, with_depths
from ..volume.amount import sizing
from ..volume.level_sets import KINDS, from_grid, save, solid_grid
from ..work import Work, chunks
from .options import (
    LayerKeywords,
    MeshKeywords,
    RenderKeywords,
    Source,
    as_scene,
    job_of,
    job_with,
    keywords,
    resolve,
    work_of,
)

if TYPE_CHECKING:
    from shapely import MultiPolygon


STEP = 1e-6
"""Half the length of central differences, longest sides of a shape."""


def gradient(shape: Node, *points: ArrayLike) -> Any:
    """See `Node.gradient`."""
    return of_library(_gradient(shape, _points(*points)), points[0])


def normals(shape: Node, *points: ArrayLike) -> Any:
    """See `Node.normals`."""
    found = _gradient(shape, _points(*points))
    length = np.linalg.norm(found, axis=-1, keepdims=True)
    return of_library(np.divide(found, length, out=np.zeros_like(found), where=length > 0), points[0])


def _gradient(shape: Node, array: NDArray[np.floating]) -> NDArray[np.float64]:
    box, array = shape.bounds.box, array.astype(np.float64)
    step = STEP * (max(box.size) if box.finite and max(box.size) > 0 else 1.0)
    moved = array[..., None, :] + step * np.concatenate([np.eye(3), -np.eye(3)])
    values = _distance(shape, moved)
    difference: NDArray[np.float64] = (values[..., :3] - values[..., 3:]) / (2 * step)
    return difference


def distance(shape: Node, *points: ArrayLike) -> Any:
    """See `Node.distance`."""
    return of_library(_distance(shape, _points(*points)), points[0])


def _distance(shape: Node, array: NDArray[np.floating]) -> NDArray[np.floating]:
    """The field at points [..., 3]."""
    kernel = _with_depths(shape).kernel("cpu", "float32" if array.dtype == np.float32 else "float64")
    flat, values = array.reshape(-1, 3), np.empty(array.size // 3, array.dtype)

    def evaluate(part: slice) -> None:
        values[part] = kernel.points(*flat[part].T)

    Work().map(evaluate, chunks(len(flat), kernel.batch))
    return values.reshape(array.shape[:-1])


def _points(*points: ArrayLike) -> NDArray[np.floating]:
    """Points, or coordinates along each axis, as an array of float32 or float64, [..., 3].

    Raises `SceneError` for any other shape or type.
    """
    if len(points) not in (1, 3):
        raise SceneError(f"expected points, or x, y and z; found {len(points)} values")
    try:
        arrays = [on_host(given) for given in points]
        array = arrays[0] if len(arrays) == 1 else np.stack(np.broadcast_arrays(*arrays), -1)
        array = array if array.dtype == np.float32 else array.astype(np.float64, casting="same_kind")
    except BufferError as error:
        raise SceneError(f"points: {error}") from None
    except (TypeError, ValueError):
        raise SceneError("points: expected numbers, an array [..., 3], or x, y and z") from None
    if array.ndim == 0 or array.shape[-1] != 3:
        raise SceneError(f"points: expected an array [..., 3], found one of shape {list(array.shape)}")
    return array


@lru_cache(maxsize=32)
def _with_depths(shape: Node) -> Node:
    """The shape with automatic iterations replaced by numbers. Raises `SceneError` if it is unbounded."""
    known = with_depths(shape)
    for node in known.solids():
        if AUTO in (value for value in node.values.values() if isinstance(value, str)):
            raise node.fail("iterations: expected a number where the shape has no end")
    return known


@keywords(MeshJob, Print)
def make_mesh(
    shape: Source,
    job: MeshJob | None = None,
    work: Work | None = None,
    *,
    path: str | Path | None = None,
    spacing: float | Sequence[float] | None = None,
    iso: float | None = None,
    **options: Unpack[MeshKeywords],
) -> Result:
    """Make a printable mesh of a shape.

    Lengths are numbers in mm, or text such as "0.5mm". Keywords set the fields of `MeshJob`, `Print` and
    `Work`, and override those of the records and of the scene. ``up="auto"`` is the best direction up that
    `fracslice orient` finds.

    Parameters
    ----------
    shape : Node, Scene, str, path, mesh, array or callable
        A shape such as ``sphere(0.5) - box()``, a scene, a scene file, or the name of a shipped scene or a
        formula; a mesh; numbers or samples of a grid, as for `from_grid`; a function, as for `from_function`.
    job : MeshJob, optional
        Settings of the mesh, as a record.
    work : Work, optional
        Threads, progress, cancellation, store and device, as a record.
    path : str or path, optional
        The file to write, in the format of its extension. An .stl file may be larger than memory: the mesh
        is then only in that file, and access to its vertices raises `TooLargeError`.
    spacing, iso : optional
        Of an array: distance between its numbers, and value at the surface.
    {options}
    Returns
    -------
    Result
        The mesh in mm and its `report`. An unprintable mesh is returned, too; its report lists the problems.

    Raises
    ------
    SceneError
        For an invalid shape, name or value.
    VolumeError, MeshError
        For a field without a surface, or too large a job.
    ExportError
        For a file that cannot be written.
    TypeError
        For an unknown keyword.
    Cancelled
        When `cancel` is set.

    Examples
    --------
    >>> from fracslice import box, make_mesh, sphere
    >>> mesh = make_mesh(box((10, 10, 10)) - sphere(6), resolution=32)
    >>> mesh.is_watertight, mesh.size.round(3).tolist()
    (True, [10.0, 10.0, 10.0])
    >>> mesh.report.problems
    ()
    >>> make_mesh("menger-sponge", size="2cm", resolution=27).size.round(3).tolist()
    [20.0, 20.0, 20.0]
    """
    if spacing is not None or iso is not None:
        shape = from_grid(cast("ArrayLike", shape), 1.0 if spacing is None else spacing, iso=iso)
    scene = as_scene(shape)
    given = job or MeshJob()
    edited = replace(scene, printing=given.edits(scene))
    work = work_of(options, work)
    return make_mesh_job(scene, job_of(given, edited, options, work), work, path)


S = TypeVar("S", bound=np.generic)
T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True, eq=False, repr=False)
class Layers(Sequence[T_co], Generic[T_co]):
    """Sequence with one item for each layer, from the bottom up, computed on access.

    Iteration computes layers in parallel, a few ahead. Nothing is cached.

    Attributes
    ----------
    stack : Stack
        Plan of the layers.
    chosen : range
        Indices of the layers in the stack.
    make : callable
        Converts a `Layer` to an item.
    work : Work
        Threads, progress and cancellation.
    """

    stack: Stack
    chosen: range
    make: Callable[[Layer], T_co]
    work: Work

    def _repr_png_(self) -> bytes | None:
        """Contact sheet in a notebook; None without layers."""
        from ..slicing.raster import contact_sheet

        file = io.BytesIO()
        if len(self):
            contact_sheet(self.stack, file, self.work, self.chosen)
        return file.getvalue() or None

    def __len__(self) -> int:
        return len(self.chosen)

    def __repr__(self) -> str:
        x, y, z = self.stack.size
        return (
            f"<{type(self).__name__}: {format_count(len(self), 'layer')} of {x:.6g} x {y:.6g} x {z:.6g} mm>"
        )

    @overload
    def __getitem__(self, index: int) -> T_co: ...
    @overload
    def __getitem__(self, index: slice) -> Layers[T_co]: ...
    def __getitem__(self, index: int | slice) -> T_co | Layers[T_co]:
        if isinstance(index, slice):
            return replace(self, chosen=self.chosen[index])
        return next(iter(replace(self, chosen=range(self.chosen[index], self.chosen[index] + 1))))

    def __iter__(self) -> Iterator[T_co]:
        if self.chosen.step < 0:
            return (self[k] for k in range(len(self)))
        return Slicer(self.stack, self.work).map(self.make, self.chosen)

    @property
    def tops(self) -> NDArray[np.float64]:
        """Tops of the layers, mm above the object's lowest point, float64 [n]."""
        return _frozen(self.stack.tops[list(self.chosen)])

    @property
    def heights(self) -> NDArray[np.float64]:
        """Heights of the layers, mm, float64 [n]."""
        return _frozen(self.stack.heights[list(self.chosen)])

    @property
    def pixel(self) -> tuple[float, float]:
        """Width and height of a pixel, mm."""
        return self.stack.pixel

    @property
    def size(self) -> tuple[float, float, float]:
        """The object's size, mm."""
        return self.stack.size


class Slices(Layers[NDArray[np.uint8]]):
    """Layers as pictures: uint8 [ny, nx], 255 where a pixel is entirely inside; row 0 is the front.

    The object's centre is at the centre of the picture. ``np.stack(slices)`` is the whole volume.
    """

    @property
    def polygons(self) -> Layers[MultiPolygon]:
        """Layers as MultiPolygon objects of shapely, in mm from the centre of the object's box.

        Raises
        ------
        SliceError
            If shapely is not installed.
        """
        if reason := lacking("shapely", "polygons need"):
            raise SliceError(reason)
        return Layers(self.stack, self.chosen, _polygons, self.work)

    @property
    def contours(self) -> Layers[Contours]:
        """Layers as closed polylines, without shapely."""
        return Layers(self.stack, self.chosen, _contours, self.work)


@keywords(SliceJob, Print)
def slice_layers(
    shape: Source,
    layer: AnyLength | Sequence[AnyLength] = "0.05mm",
    **options: Unpack[LayerKeywords],
) -> Slices:
    """Slice a shape into the layers of a print, directly from its field.

    Lengths are numbers in mm, or text such as "0.05mm". ``up="auto"`` is the best direction up that
    `fracslice orient` finds.

    Parameters
    ----------
    shape : Node, Scene, str or path
        As for `make_mesh`.
    layer : float or str, or two of them
        Layer height; or its minimum and maximum, for adaptive layers that are thick where the surface is
        steep.
    {options}
    Returns
    -------
    Slices
        A sequence of arrays, one for each layer, computed on access.

    Raises
    ------
    SceneError, SliceError
        For an invalid shape or value.
    VolumeError
        For a field without a surface.
    TypeError
        For an unknown keyword.
    Cancelled
        When `cancel` is set.

    Examples
    --------
    >>> from fracslice import cylinder, slice_layers
    >>> slices = slice_layers(cylinder(2, 1), layer=0.25, pixel="0.1mm")
    >>> len(slices), slices[0].dtype.name, slices.tops.tolist()
    (4, 'uint8', [0.25, 0.5, 0.75, 1.0])
    >>> round(slices.contours[0].area, 2)
    12.57
    """
    work = work_of(options)
    scene = as_scene(shape, options.get("size"))
    job = job_of(SliceJob(layer=layer), scene, options, work)
    stack = plan_layers(scene.root, job, work, sizing(scene, job.size, job.scale, work))
    return Slices(stack, range(len(stack.z)), _coverage, work)


def _coverage(layer: Layer) -> NDArray[np.uint8]:
    return _frozen(layer.coverage)


def _polygons(layer: Layer) -> MultiPolygon:
    return as_polygons(layer.contours)


def _contours(layer: Layer) -> Contours:
    contours = layer.contours
    for array in (contours.points, contours.starts, contours.parent):
        _frozen(array)
    return contours


def _frozen(array: NDArray[S]) -> NDArray[S]:
    array.flags.writeable = False
    return array


def as_polygons(contours: Contours) -> MultiPolygon:
    """Convert contours to polygons: each outer contour with the holes directly inside it.

    Parameters
    ----------
    contours : Contours
        Contours of a layer.

    Returns
    -------
    MultiPolygon
        In mm from the centre of the object's box.
    """
    from shapely import MultiPolygon, Polygon

    depth = [0] * len(contours)
    holes: list[list[NDArray[np.float64]]] = [[] for _ in depth]
    for k, parent in enumerate(contours.parent.tolist()):
        if parent >= 0:
            depth[k] = depth[parent] + 1
            holes[parent].append(contours[k])
    return MultiPolygon([Polygon(contours[k], holes[k]) for k, d in enumerate(depth) if d % 2 == 0])


def sweep(
    scene: Source,
    values: Mapping[str, Iterable[Any]],
    job: MeshJob | None = None,
    work: Work | None = None,
    **options: Unpack[MeshKeywords],
) -> Iterator[Result]:
    """Make meshes of a scene with one value after another.

    Parameters
    ----------
    scene : Node, Scene, str or path
        As for `make_mesh`.
    values : mapping of str to iterable
        Values by name, as for `Scene.with_values`: ``{"mandelbulb.power": range(2, 9)}``. Of several names,
        all combinations are made; the last name changes fastest.
    job : MeshJob, optional
        Settings of the meshes, as a record.
    work : Work, optional
        Threads, progress, cancellation, store and device, as a record.
    **options
        Keywords of `make_mesh`.

    Returns
    -------
    iterator of Result
        A mesh for each combination, made when it is asked for.

    Raises
    ------
    SceneError
        For an unknown name, or as `make_mesh`.

    Examples
    --------
    >>> from fracslice import menger, sweep
    >>> [len(mesh.faces) > 0 for mesh in sweep(menger(), {"menger.level": [0, 1]}, size=10, resolution=9)]
    [True, True]
    """
    whole = as_scene(scene)
    chosen = [
        whole.with_values([f"{name}={_text(value)}" for name, value in zip(values, some, strict=True)])
        for some in product(*values.values())
    ]
    return (make_mesh(one, job, work, **options) for one in chosen)


def _text(value: Any) -> str:
    """A value as a scene file has it: several numbers with spaces between."""
    return " ".join(map(str, items(value)))


FILM = Film(width=640, height=480, samples=16)
"""Film of a shape without a scene, for a quick picture."""


class Picture(np.ndarray):
    """A picture, uint8 [height, width, 3], sRGB, that notebooks display."""

    def save(self, path: str | Path) -> Path:
        """Write the picture to a file, atomically.

        Parameters
        ----------
        path : str or path
            The file, in the format of its extension: .png, .jpg or .webp.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ExportError
            For another extension, an array that is no picture, or a file that cannot be written.
        """
        from ..export.images import LOSSY

        kinds, ending = (".png", *LOSSY), Path(path).suffix.lower()
        if ending not in kinds:
            raise ExportError(f"{path}: unknown kind of file; known are {', '.join(kinds)}")
        data = self._encoded(ending)
        if data is None:
            raise ExportError(
                f"{path}: expected uint8 [height, width, 3], found {self.dtype} {list(self.shape)}"
            )
        with replacing(path) as file:
            file.write(data)
        return Path(path)

    def _repr_png_(self) -> bytes | None:
        return self._encoded(".png")

    def _encoded(self, ending: str) -> bytes | None:
        from ..export.images import encoded_image

        if self.dtype != np.uint8 or self.ndim != 3 or self.shape[2] != 3:
            return None  # a slice of a picture need not be a picture
        shown = np.asarray(self) / 255
        return encoded_image(ending, shown, shown)


def page(shape: Node) -> str:
    """A shape as HTML: a picture of it where it has one, and its elements."""
    from base64 import b64encode
    from html import escape

    elements = f"<pre>{escape(element_to_xml(shape))}</pre>"
    try:
        picture = render(shape, size=(320, 240), samples=4)
    except FracsliceError as error:
        return f"{elements}<p>{escape(str(error))}</p>"
    data = b64encode(picture._repr_png_() or b"").decode()
    return f'<img src="data:image/png;base64,{data}" width="320" height="240"/>{elements}'


@keywords(RenderJob)
def render(
    shape: Source,
    job: RenderJob | None = None,
    *,
    path: str | Path | None = None,
    camera: Camera | None = None,
    lights: Sequence[Light] | None = None,
    **options: Unpack[RenderKeywords],
) -> Picture:
    """Render a picture of a shape.

    Keywords set the fields of `RenderJob` and `Work`, and override those of the record. A shape without a
    scene has 640 x 480 pixels of 16 samples by default.

    Parameters
    ----------
    shape : Node, Scene, str or path
        As for `make_mesh`.
    job : RenderJob, optional
        Settings of the picture, as a record.
    path : str or path, optional
        The file to write, in the format of its extension: .png, .jpg, .webp, or linear floats as .exr or
        .tif. A .png, .exr or .tif file may be larger than memory: the picture is then only in that file,
        and `TooLargeError` says so.
    camera : Camera, optional
        The camera, in scene units; by default the scene's, or one that shows the whole shape.
    lights : sequence of Light, optional
        The lights; by default the scene's, or a sun and a sky.
    {options}
    Returns
    -------
    Picture
        An array, uint8 [height, width, 3], sRGB, that notebooks display.

    Raises
    ------
    SceneError, RenderError
        For an invalid shape, view or value.
    ExportError
        For a file that cannot be written.
    TooLargeError
        For a picture that does not fit in memory; one with a path is in the file.
    TypeError
        For an unknown keyword.
    Cancelled
        When `cancel` is set.

    Examples
    --------
    >>> from fracslice import box, render, sphere
    >>> picture = render(box() - sphere(0.6), size=(64, 48), samples=1)
    >>> picture.shape, picture.dtype.name
    ((48, 64, 3), 'uint8')
    """
    if not isinstance(camera, Camera | None):
        raise TypeError(f"camera={camera!r}: expected a Camera")
    if lights is not None and not (
        isinstance(lights, Sequence) and all(isinstance(lamp, Light) for lamp in lights)
    ):
        raise TypeError(f"lights={lights!r}: expected a sequence of Light")
    what, work = resolve(shape), work_of({**options, "device": None})
    scene = Scene(what, 1.0, view=View(film=FILM)) if isinstance(what, Node) else what
    given: dict[str, Any] = {"camera": camera, "lights": None if lights is None else tuple(lights)}
    view = replace(scene.view, **{name: value for name, value in given.items() if value is not None})
    picture = job_with(job or RenderJob(), options)
    device = options.get("device") or "auto"
    done = make_picture(replace(scene, view=view), picture, work, path, device=device).done
    if done is None:
        raise TooLargeError(f"{path}: holds the picture, which does not fit in memory")
    array = done.shown.view(Picture)
    array.flags.writeable = False
    return array


def write_vdb(
    shape: Source,
    path: str | os.PathLike[str],
    *,
    kind: Literal["surface", "density"] = "surface",
    half: bool = False,
    size: AnyLength | None = None,
    voxel: AnyLength | None = None,
    resolution: float | None = None,
    metadata: Mapping[str, str] | None = None,
    work: Work | None = None,
) -> Path:
    """Write a shape to an OpenVDB file, as Blender and Houdini read it.

    The grid has the name of its kind, the class that OpenVDB has for it, a transform to mm, and the place of
    the shape itself. The same shape gives the same bytes.

    Parameters
    ----------
    shape : Node, Scene, mesh, str or path
        As for `make_mesh`.
    path : str or path
        The file, with the extension .vdb.
    kind : {"surface", "density"}
        Signed distances within three voxels of the surface, mm, negative inside: a level set. Or densities, 1
        inside, 0 outside and 1/2 at the surface, in the middle of a ramp of six voxels: a fog volume.
    half : bool
        Whether numbers have 16 bits in the file, with an error of up to 1/2048 of them.
    size, voxel : float or str, optional
        Longest side and voxel, mm, or text with a unit.
    resolution : float, optional
        Voxels along the longest side, instead of a voxel; by default 256.
    metadata : mapping of str to str, optional
        Names and texts for the grid.
    work : Work, optional
        Threads, progress, cancellation, store and device.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    SceneError, VolumeError
        For an invalid shape or value, or a shape without a surface.
    ExportError
        For another extension, or a file that cannot be written.
    Cancelled
        When the event of the work is set.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from fracslice import from_vdb, sphere, write_vdb
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write_vdb(sphere(10), pathlib.Path(folder) / "ball.vdb", resolution=64)
    ...     ball = from_vdb(path)
    ...     abs(float(ball.distance([0, 0, 12])) - 2) < 0.02
    True
    """
    validate_value("kind", kind, Choice(None, "", KINDS), ExportError)
    target, work = Path(path), work or Work()
    if target.suffix.lower() != ".vdb":
        raise ExportError(f"{path}: expected the extension .vdb")
    check_target(target)
    scene = as_scene(shape)
    job = MeshJob(size=size, voxel=voxel, resolution=resolution)
    sized = sizing(scene, job.size, work=work)
    planned = plan(scene.root, job.voxels(sized.longest), work)
    grid = solid_grid(planned, sized.scale(planned.box), kind, work)
    grid.half = half
    save(grid, target, {"creator": APPLICATION, **(metadata or {})})
    return target
