"""Scenes of Mandelbulber 2 as scenes of ours, with a list of what was not understood."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from ...common.parameters import printable
from ...errors import KernelError, SceneError
from ...formulas import Node, get
from ..model import Scene, scene
from . import appearance
from .films import film
from .objects import orbits, solid
from .sequences import Orbit, Slot, steps_of
from .settings import Settings, read_settings
from .step_text import UnknownError

IGNORED = (
    "flight_",
    "keyframe_",
    "image_proportion",
    "legacy_coordinate_system",
    "camera_rotation",
    "camera_distance_to_target",
    "detail_level",
    "DE_",
    "delta_DE",
    "antialiasing",
    "opencl",
    "use_default_bailout",
    "bailout",
    "smoothness",
    "view_distance",
    "voxel_",
    "MC_",
    "frames_per",
    "show_",
    "mesh_",
    "anim_",
)
"""Beginnings of names that change neither shape nor appearance here: how a picture is computed there."""


@dataclass(frozen=True)
class Imported:
    """A scene of another program, and what is not in it."""

    scene: Scene
    formulas: tuple[str, ...]  # names of the formulas that it has
    missing: tuple[str, ...]  # formulas that were left out, "file:line: name"
    notes: tuple[str, ...]  # what is not as in the file, "file:line: what"
    ignored: tuple[str, ...]  # names of values that were not understood


def import_scene(path: str | os.PathLike[str], leave_out: bool = False) -> Imported:
    """Read a scene of Mandelbulber 2.

    Parameters
    ----------
    path : str or path
        A settings file, ``.fract``.
    leave_out : bool
        Whether formulas that are not known here are left out; else they are an error.

    Returns
    -------
    Imported
        The scene, and what was not understood.

    Raises
    ------
    SceneError
        If the file is invalid, or has a formula that is not known here: "file:line: message".
    """
    settings = read_settings(path)
    try:
        return _imported(settings, orbits(settings, leave_out))
    except UnknownError as error:
        raise SceneError(f"{error}: this variant is not known here") from None
    except (SceneError, KernelError) as error:
        message = " ".join(str(error).split())
        raise SceneError(
            message if message.startswith(settings.path) else f"{settings.path}: {message}"
        ) from None


def _imported(settings: Settings, made: list[Orbit]) -> Imported:
    """Scene of settings; its errors may lack the name of the file."""
    node = _clipped(solid(settings, made), settings)
    name = printable(Path(settings.path).stem)
    seen = scene(node, size="60mm", name=name, view=appearance.view(settings))
    animation, tracks = film(settings, node, made[0].notes)
    seen = replace(seen, animation=animation, tracks=tracks)
    slots = [slot for orbit in made for slot in orbit.slots]
    known = tuple(dict.fromkeys(slot.known.name for slot in slots if slot.known))
    missing = tuple(line for orbit in made for line in orbit.missing)
    notes = [line for orbit in made for line in orbit.notes]
    notes += [f"{settings.path}: section [{name}] is left out" for name in settings.others]
    return Imported(seen, known, missing, tuple(notes), tuple(_ignored(settings, slots)))


def unknown(path: str | os.PathLike[str]) -> str | None:
    """Return the message about the first formula of a file, or variant of one, that is not known here."""
    try:
        for orbit in orbits(read_settings(path)):
            steps_of(orbit)
    except (SceneError, UnknownError) as error:
        return str(error)
    return None


def _clipped(node: Node, settings: Settings) -> Node:
    """The part within the limits of the file."""
    main = settings.main
    if not main.flag("limits_enabled", "false"):
        return node
    low, high = main.vector("limit_min", "-10 -10 -10"), main.vector("limit_max", "10 10 10")
    return get("bounds")(node, min=low, max=high)


def _ignored(settings: Settings, slots: list[Slot]) -> Iterator[str]:
    used = {settings.main.name, *(s.values.name for s in slots)}
    for section in settings.sections:
        if section.name in used:
            for name, value in section.unasked():
                if not name.startswith(IGNORED):
                    yield f"{settings.path}:{value.line}: {name}"
