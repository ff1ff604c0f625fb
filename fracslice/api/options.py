"""Inputs and keyword arguments of the public calls, and their conversion to records."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import wraps
from inspect import Parameter, cleandoc, signature
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeAlias, TypedDict, TypeVar, cast, get_type_hints

from numpy.typing import NDArray

from ..common.cache import warn
from ..common.messages import hint
from ..common.parameters import REQUIRED, AnyLength, AnyScale, Record, parameter_lines, short_repr
from ..errors import SceneError
from ..fields.devices import choose_device
from ..fields.node import TriangleMesh
from ..formats import SOLIDS
from ..formulas import Formula, Node, get
from ..formulas import names as formula_names
from ..records import Colour, MeshJob, RenderJob, SliceJob
from ..scene import Print, Scene, library, read, scene
from ..volume.bricks import Bricks
from ..volume.level_sets import from_bricks, from_function, from_grid
from ..work import Work

P = ParamSpec("P")
R = TypeVar("R")
J = TypeVar("J", MeshJob, SliceJob)
K = TypeVar("K", MeshJob, SliceJob, RenderJob)


class WorkKeywords(TypedDict, total=False):
    """Execution: fields of `Work`."""

    threads: int | None
    progress: Callable[[str, float], None] | None
    cancel: threading.Event | None
    device: Literal["cpu", "cuda", "auto"] | None


class PrintKeywords(TypedDict, total=False):
    """Print preparation: the fields of `Print`."""

    cavities: Literal["keep", "fill"] | None
    keep: int | Literal["all", "largest"] | None
    bridge: AnyLength | None
    gap: AnyLength | None
    thickness: AnyLength | None
    hollow: AnyLength | None
    drain: AnyLength | None
    drain_at: str | Sequence[Sequence[float]] | None
    base: AnyLength | None
    raft: AnyLength | None
    supports: Literal["none", "light", "medium", "heavy"] | None


class PlacedKeywords(PrintKeywords, WorkKeywords, total=False):
    """Size and orientation, print preparation and execution."""

    size: AnyLength | None
    up: Sequence[float] | Literal["auto"] | None
    scale: AnyScale | None


class MeshKeywords(PlacedKeywords, total=False):
    """A mesh: the fields of `MeshJob`, and the others."""

    voxel: AnyLength | None
    resolution: float | None
    chord: AnyLength | None
    simplify: AnyLength | None
    faces: int | None
    dust: float | None
    colour: Colour | None
    palette: str | Sequence[str] | None
    filaments: int | str | Sequence[str] | None
    bodies: bool | None
    heights: AnyLength | Sequence[AnyLength | None] | None
    paint_supports: bool | None
    proved: bool | None


class RenderKeywords(WorkKeywords, total=False):
    """A picture: the fields of `RenderJob`, and execution."""

    size: Sequence[int] | str | None
    samples: int | None
    crop: Sequence[int] | str | None
    seed: int | None
    time: float | str | None
    denoise: bool | None
    layers: bool | None
    bits: int | None


class LayerKeywords(PlacedKeywords, total=False):
    """Layers: fields of `SliceJob`, and the others."""

    pixel: AnyLength | Sequence[AnyLength] | None


WORK = {
    "threads": ("int", "number of threads; one for each core by default"),
    "progress": ("callable", "called repeatedly as ``progress(stage, share)``, the share from 0 to 1"),
    "cancel": ("threading.Event", "setting it stops the work with `Cancelled`"),
    "device": ('{"cpu", "cuda", "auto"}', "device that evaluates the field"),
}
"""Type and meaning of the fields of `WorkKeywords`."""


def work_of(options: Mapping[str, Any], work: Work | None = None) -> Work:
    """Work record with the given options.

    Parameters
    ----------
    options : mapping
        Fields to override; None keeps the field of `work`.
    work : Work, optional
        Base record; the defaults of `Work` without it.

    Raises
    ------
    TypeError
        If progress is not callable, or cancel is not an event.
    """
    given = _given_options(options, WORK)
    if "device" in given:
        given["device"] = choose_device(given["device"])
    if not callable(given.get("progress", print)):
        raise TypeError(f"progress={given['progress']!r}: expected a callable (stage, share)")
    if not isinstance(given.get("cancel", threading.Event()), threading.Event):
        raise TypeError(f"cancel={given['cancel']!r}: expected a threading.Event")
    return replace(work or Work(), **given)


def print_of(scene: Scene, options: Mapping[str, Any]) -> Print:
    """Print record of a scene with the given options.

    Parameters
    ----------
    scene : Scene
        The scene with its own print settings.
    options : mapping
        Fields to override; None keeps the field of the scene.
    """
    return replace(scene.printing, **_given_options(options, Print.kinds()))


def job_of(job: J, scene: Scene, options: Mapping[str, Any], work: Work | None = None) -> J:
    """Job of a scene with the given options.

    Parameters
    ----------
    job : MeshJob or SliceJob
        The base record.
    scene : Scene
        The scene with its own print settings.
    options : mapping
        Fields of the job and of `Print` to override; None keeps the field. The direction up "auto" is the
        best one that is found.
    work : Work, optional
        Threads, progress and cancellation of the search for it.
    """
    up = options.get("up")
    if not (isinstance(up, str) and up == "auto"):
        return replace(job_with(job, options), printing=print_of(scene, options))
    from ..slicing.orientation import best_up

    made = job_of(job, scene, {**options, "up": None})
    return replace(made, up=best_up(scene, made, work))


def job_with(job: K, options: Mapping[str, Any]) -> K:
    """Job with the given options.

    Parameters
    ----------
    job : MeshJob, SliceJob or RenderJob
        The base record.
    options : mapping
        Fields of the job to override; None keeps the field.
    """
    return replace(job, **_given_options(options, job.kinds()))


def _given_options(options: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    return {name: options[name] for name in names if options.get(name) is not None}


def keywords(*records: type[Record]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function whose ``**options`` are a typed dictionary: list them in its signature, and in its
    docstring in place of ``{options}``.

    Called with an unknown keyword, the function raises a `TypeError` that names the nearest known one.
    """

    def decorated(function: Callable[P, R]) -> Callable[P, R]:
        own = signature(function)
        listed = [p for p in own.parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
        for rest in (p for p in own.parameters.values() if p.kind is Parameter.VAR_KEYWORD):
            kind = get_type_hints(function)[rest.name].__args__[0]
            for name, annotation in get_type_hints(kind).items():
                listed.append(Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=annotation))
        known = [p.name for p in listed]
        options = set(known) - own.parameters.keys()

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            for name in kwargs:
                if name not in known:
                    near = hint(name, known)
                    raise TypeError(f"{function.__name__}() has no argument {name!r}; {near}")
            return function(*args, **kwargs)

        lines = _option_lines(records, options)
        call.__signature__ = own.replace(parameters=listed)  # type: ignore[attr-defined]
        call.__doc__ = cleandoc(function.__doc__ or "").replace("{options}\n", "\n".join(lines))
        return call

    return decorated


def _option_lines(records: Iterable[type[Record]], known: Container[str]) -> Iterator[str]:
    """Known keywords in numpydoc style: those of records, then those of `Work`."""
    for record in records:
        yield from parameter_lines({name: kind for name, kind in record.kinds().items() if name in known})
    for name, (kind, doc) in WORK.items():
        yield from (f"{name} : {kind}, optional", f"    {doc}")
    yield ""


Source: TypeAlias = (
    Node | Scene | TriangleMesh | Bricks | Callable[..., Any] | NDArray[Any] | str | os.PathLike[str]
)


def resolve(source: Source) -> Node | Scene:
    """Resolve a source to a shape or scene.

    Parameters
    ----------
    source : Node, Scene, mesh, path or name
        A shape, a scene, a mesh, a scene file, a model file, or the name of a shipped scene or formula; an
        array or samples of a grid; a function of x, y and z, which is sampled, with a warning that says so.

    Raises
    ------
    SceneError
        For an unknown name, with the nearest known one, or a file that cannot be read.
    """
    if isinstance(source, (Node, Scene)):
        return source
    if isinstance(source, TriangleMesh):
        from ..mesh.models import from_trimesh

        return from_trimesh(source)
    if isinstance(source, Formula):
        raise SceneError(f"{source.name}: expected a shape, {source.name}(...), found the formula itself")
    if isinstance(source, Bricks):
        return from_bricks(source)
    if hasattr(source, "__array__") or hasattr(source, "__dlpack__"):
        return from_grid(cast("NDArray[Any]", source))
    if callable(source):
        warn("a function is sampled on a grid; fracslice.formulas.shape makes an exact formula of one")
        return from_function(source)
    if not isinstance(source, (str, os.PathLike)):
        wanted = "expected a shape such as sphere(), a scene, a file or a name"
        raise SceneError(f"{short_repr(source)}: {wanted}")
    path = Path(source)
    if path.suffix.lower() in SOLIDS:
        return get(SOLIDS[path.suffix.lower()])(os.fspath(source))
    if path.exists() or path.name != os.fspath(source) or path.suffix:
        return read(path)
    name = os.fspath(source)
    if name in library.names() or name in library.gallery():
        return read(library.path(name))
    ready = [n for n in formula_names() if _is_ready(get(n))]
    if name in ready:
        return get(name)()
    known = {*ready, *library.names(), *library.gallery()}
    raise SceneError(f"{name}: no such scene, formula or file; {hint(name, known)}")


def _is_ready(formula: Formula) -> bool:
    """True if a formula is a bounded shape without required parameters."""
    required = any(kind.default is REQUIRED for kind in formula.parameters.values())
    return formula.kind == "shape" and not formula.children[1] and "bounds" in formula.hooks and not required


def as_scene(source: Source, size: AnyLength | None = None) -> Scene:
    """Resolve a source to a scene.

    Parameters
    ----------
    source : Node, Scene, path or name
        A shape, a scene, a scene file, or the name of a shipped scene or formula.
    size : float or str, optional
        Longest side of a shape; by default, its scene unit is a millimetre.

    Raises
    ------
    SceneError
        As `resolve`.
    """
    what = resolve(source)
    if isinstance(what, Scene):
        return what
    return scene(what, unit=1.0) if size is None else scene(what, size=size)
