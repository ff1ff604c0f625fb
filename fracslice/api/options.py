"""The keyword arguments that several calls share, and the records that they become."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from inspect import Parameter, signature
from typing import Any, Literal, ParamSpec, TypedDict, TypeVar, get_type_hints

from ..kernel.devices import chosen
from ..nearest import hint
from ..scene import Print, Scene
from ..work import Work

P = ParamSpec("P")
R = TypeVar("R")

Length = float | str
"""A number of mm, or text with a unit, such as "0.5mm"."""


class WorkOptions(TypedDict, total=False):
    """How the work is done, as the fields of `Work`."""

    threads: int | None
    progress: Callable[[str, float], None] | None
    cancel: threading.Event | None
    device: Literal["cpu", "cuda", "auto"] | None


class PrintOptions(TypedDict, total=False):
    """What makes the object printable, as the fields of `Print`."""

    cavities: Literal["keep", "fill"] | None
    keep: Literal["all", "largest"] | None
    bridge: Length | None
    gap: Length | None
    thickness: Length | None
    hollow: Length | None
    drain: Length | None
    base: Length | None
    raft: Length | None


class Options(PrintOptions, WorkOptions, total=False):
    """Both."""


def work_of(options: WorkOptions | Options, work: Work | None = None) -> Work:
    """How the work is done: as `work` says, and the options over it.

    Raises
    ------
    TypeError
        For a progress that cannot be called.
    """
    given = _given(options, WorkOptions)
    if "device" in given:
        given["device"] = chosen(given["device"])
    if not callable(given.get("progress", print)):
        raise TypeError(f"progress={given['progress']!r}: expected a callable (stage, share)")
    return replace(work or Work(), **given)


def print_of(scene: Scene, options: Options) -> Print:
    """What makes the object printable: as the scene says, and the options over it."""
    return replace(scene.printing, **_given(options, PrintOptions))


def _given(options: Any, kind: type) -> dict[str, Any]:
    return {name: options[name] for name in kind.__annotations__ if options.get(name) is not None}


def keywords(function: Callable[P, R]) -> Callable[P, R]:
    """Spells out the options of a function in its signature; unknown names get a hint.

    Raises
    ------
    TypeError
        When the function is called with a keyword that it does not have: the message names the nearest one.
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
