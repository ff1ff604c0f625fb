"""Inputs and keyword arguments of the public calls, and their conversion to records."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeAlias, TypedDict, TypeVar, get_type_hints

from ..common.messages import hint
from ..errors import SceneError
from ..formulas import Formula, Node, get
from ..formulas import names as formula_names
from ..formulas.parameters import REQUIRED, short_repr
from ..kernel.devices import choose_device
from ..scene import Print, Scene, library, read, scene
from ..scene.lengths import AnyLength
from ..work import Work

P = ParamSpec("P")
R = TypeVar("R")


class WorkOptions(TypedDict, total=False):
    """Execution: fields of `Work`."""

    threads: int | None
    progress: Callable[[str, float], None] | None
    cancel: threading.Event | None
    device: Literal["cpu", "cuda", "auto"] | None


class PrintOptions(TypedDict, total=False):
    """Print preparation: the fields of `Print`."""

    cavities: Literal["keep", "fill"] | None
    keep: int | Literal["all", "largest"] | None
    bridge: AnyLength | None
    gap: AnyLength | None
    thickness: AnyLength | None
    hollow: AnyLength | None
    drain: AnyLength | None
    base: AnyLength | None
    raft: AnyLength | None


class Options(PrintOptions, WorkOptions, total=False):
    """Print preparation and execution."""


def work_of(options: WorkOptions | Options, work: Work | None = None) -> Work:
    """Work record with the given options.

    Parameters
    ----------
    options : WorkOptions or Options
        Fields to override; None keeps the field of `work`.
    work : Work, optional
        Base record; the defaults of `Work` without it.

    Raises
    ------
    TypeError
        If progress is not callable, or cancel is not an event.
    """
    given = _given_options(options, WorkOptions)
    if "device" in given:
        given["device"] = choose_device(given["device"])
    if not callable(given.get("progress", print)):
        raise TypeError(f"progress={given['progress']!r}: expected a callable (stage, share)")
    if not isinstance(given.get("cancel", threading.Event()), threading.Event):
        raise TypeError(f"cancel={given['cancel']!r}: expected a threading.Event")
    return replace(work or Work(), **given)


def print_of(scene: Scene, options: Options) -> Print:
    """Print record of a scene with the given options.

    Parameters
    ----------
    scene : Scene
        The scene with its own print settings.
    options : Options
        Fields to override; None keeps the field of the scene.
    """
    return replace(scene.printing, **_given_options(options, PrintOptions))


def _given_options(options: Any, kind: type) -> dict[str, Any]:
    return {name: options[name] for name in kind.__annotations__ if options.get(name) is not None}


def keywords(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function whose ``**options`` are a typed dictionary: list them in its signature.

    Returns
    -------
    callable
        The function with its full signature. Called with an unknown keyword, it raises a `TypeError` that
        names the nearest known one.
    """
    own = signature(function)
    listed = [p for p in own.parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
    for rest in (p for p in own.parameters.values() if p.kind is Parameter.VAR_KEYWORD):
        kind = get_type_hints(function)[rest.name].__args__[0]
        for name, annotation in get_type_hints(kind).items():
            listed.append(Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=annotation))
    known = [p.name for p in listed]

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in kwargs:
            if name not in known:
                near = hint(name, known)
                raise TypeError(f"{function.__name__}() has no argument {name!r}; {near}")
        return function(*args, **kwargs)

    call.__signature__ = own.replace(parameters=listed)  # type: ignore[attr-defined]
    return call


Source: TypeAlias = Node | Scene | str | os.PathLike[str]


def resolve(source: Source) -> Node | Scene:
    """Resolve a source to a shape or scene.

    Parameters
    ----------
    source : Node, Scene, path or name
        A shape, a scene, a scene file, or the name of a shipped scene or formula.

    Raises
    ------
    SceneError
        For an unknown name, with the nearest known one, or a file that cannot be read.
    """
    if isinstance(source, (Node, Scene)):
        return source
    if isinstance(source, Formula):
        raise SceneError(f"{source.name}: expected a shape, {source.name}(...), found the formula itself")
    if not isinstance(source, (str, os.PathLike)):
        wanted = "expected a shape such as sphere(), a scene, a file or a name"
        made = "; formulas.shape makes a formula of a function" if callable(source) else ""
        raise SceneError(f"{short_repr(source)}: {wanted}{made}")
    path = Path(source)
    if path.exists() or path.name != os.fspath(source) or path.suffix:
        return read(path)
    name = os.fspath(source)
    if name in library.names():
        return read(library.path(name))
    ready = [n for n in formula_names() if _is_ready(get(n))]
    if name in ready:
        return get(name)()
    raise SceneError(f"{name}: no such scene, formula or file; {hint(name, {*ready, *library.names()})}")


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
