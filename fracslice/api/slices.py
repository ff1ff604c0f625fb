"""A shape becomes the layers of a print, as arrays and as polygons."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Generic, TypeVar, Unpack, overload

import numpy as np
from numpy.typing import NDArray

from ..errors import SliceError
from ..extras import lacking
from ..scene import parse_length
from ..slicing import Contours, Layer, SliceJob, Slicer, Stack, adapted, plan_stack
from ..work import Work
from .options import Length, Options, keywords, print_of, work_of
from .sources import Source, as_scene

if TYPE_CHECKING:
    from shapely import MultiPolygon

S = TypeVar("S", bound=np.generic)
T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True, eq=False, repr=False)
class Layers(Sequence[T_co], Generic[T_co]):
    """One thing for each layer, from the bottom up, computed when it is asked for.

    Iterating computes layers in parallel, a few ahead; nothing is kept.

    stack: the plan of the layers. chosen: their numbers. make: what is made of each. work: how.
    """

    stack: Stack
    chosen: range
    make: Callable[[Layer], T_co]
    work: Work

    def __len__(self) -> int:
        return len(self.chosen)

    def __repr__(self) -> str:
        x, y, z = self.stack.size
        return f"<{type(self).__name__}: {len(self)} layers of {x:.6g} x {y:.6g} x {z:.6g} mm>"

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
        """Upper faces of the layers, mm above the object's lowest point, float64 [n]."""
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
    """The layers as pictures: uint8 [ny, nx], 255 where a pixel is wholly inside; row 0 is the front.

    The object's middle is in the middle of the picture. ``np.stack(slices)`` is the whole volume.
    """

    @property
    def polygons(self) -> Layers[MultiPolygon]:
        """The layers as MultiPolygon objects of shapely, mm from the middle of the object's box.

        Raises
        ------
        SliceError
            If shapely is not installed.
        """
        if reason := lacking("shapely", "polygons need"):
            raise SliceError(reason)
        return Layers(self.stack, self.chosen, lambda layer: as_polygons(layer.contours), self.work)

    @property
    def contours(self) -> Layers[Contours]:
        """The layers as closed polylines, without shapely."""
        return Layers(self.stack, self.chosen, _contours, self.work)


@keywords
def slice_layers(
    shape: Source,
    layer: Length | tuple[Length, Length] = "0.05mm",
    *,
    size: Length | None = None,
    pixel: Length | tuple[Length, Length] = "0.05mm",
    up: Sequence[float] = (0.0, 0.0, 1.0),
    **options: Unpack[Options],
) -> Slices:
    """Cut a shape into the layers of a print, straight from its field.

    Lengths are numbers of mm, or text such as "0.05mm".

    Parameters
    ----------
    shape : Node, Scene, str or path
        As `make_mesh` takes it.
    layer : float or str, or two of them
        The layer height; or the lowest and the highest, for layers as high as the slope allows.
    size : float or str, optional
        The longest side. A scene has its own; without one, a scene unit of a shape is a millimetre.
    pixel : float or str, or two of them
        Width and height of a pixel, or one length for both.
    up : three numbers
        The direction of the shape that is up in the print.
    cavities, keep, bridge, gap, thickness, hollow, drain, base, raft : optional
        What makes the object printable, as the fields of `Print`.
    threads, progress, cancel, device : optional
        As of `make_mesh`.

    Returns
    -------
    Slices
        A sequence of arrays, one for each layer, that are computed when they are asked for.

    Raises
    ------
    SceneError, SliceError
        For a shape or a value that cannot be.
    VolumeError
        For a field without a surface.
    TypeError
        For an unknown keyword.
    Cancelled
        When somebody asked to stop.

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
    scene = as_scene(shape, size, work)
    low, high = layer if isinstance(layer, (tuple, list)) else (layer, None)
    side = scene.size_mm if size is None else parse_length(size, "size")
    job = SliceJob(side, low, pixel, up, print_of(scene, options))  # type: ignore[arg-type]
    stack = plan_stack(scene.root, job, work)
    if high is not None:
        stack = adapted(stack, parse_length(high, "layer"), work)
    return Slices(stack, range(len(stack.z)), _coverage, work)


def _coverage(layer: Layer) -> NDArray[np.uint8]:
    return _frozen(layer.coverage)


def _contours(layer: Layer) -> Contours:
    found = layer.contours
    for array in (found.points, found.starts, found.parent):
        _frozen(array)
    return found


def _frozen(array: NDArray[S]) -> NDArray[S]:
    array.flags.writeable = False
    return array


def as_polygons(contours: Contours) -> MultiPolygon:
    """The inside of contours: each outer one with the holes just within it."""
    from shapely import MultiPolygon, Polygon

    depth = [0] * len(contours)
    holes: list[list[NDArray[np.float64]]] = [[] for _ in depth]
    for k, parent in enumerate(contours.parent.tolist()):
        if parent >= 0:
            depth[k] = depth[parent] + 1
            holes[parent].append(contours[k])
    return MultiPolygon([Polygon(contours[k], holes[k]) for k, d in enumerate(depth) if d % 2 == 0])
