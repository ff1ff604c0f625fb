"""Slicing of shapes and scenes into the layers of a print, as arrays and as polygons."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Generic, TypeVar, Unpack, overload

import numpy as np
from numpy.typing import NDArray

from ..common.messages import format_count, lacking
from ..common.parameters import AnyLength
from ..errors import SliceError
from ..scene import Print
from ..slicing import Contours, Layer, SliceJob, Slicer, Stack, plan_layers
from ..volume.sizing import sizing
from ..work import Work
from .options import LayerKeywords, Source, as_scene, job_of, keywords, work_of

if TYPE_CHECKING:
    from shapely import MultiPolygon

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
        from ..slicing.preview import contact_sheet

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

    Lengths are numbers in mm, or text such as "0.05mm".

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
    job = job_of(SliceJob(layer=layer), scene, options)
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
