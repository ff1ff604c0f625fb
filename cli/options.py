"""The options that commands share, and the kinds of values they take."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from fracslice.errors import SceneError

if TYPE_CHECKING:
    from fracslice.job import MeshJob
    from fracslice.scene import Print, Scene


def length(_: click.Context, __: click.Parameter, value: str | None) -> float | None:
    """A length with a unit, in mm."""
    from fracslice.scene import parse_length

    try:
        return None if value is None else parse_length(value)
    except SceneError as error:
        raise click.BadParameter(str(error)) from None


def amount(_: click.Context, __: click.Parameter, value: float | None) -> float | None:
    """A finite number of at least zero."""
    if value is not None and not 0 <= value < math.inf:
        raise click.BadParameter(f"{value:g}: expected a finite number >= 0")
    return value


def job_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """What to make: adds the options that `job_of` takes."""
    for option in reversed(_JOB):
        command = option(command)
    return command


_JOB = [
    click.option(
        "--size", callback=length, metavar="LENGTH", help="The longest side, such as 80mm, 8cm or 3.1in."
    ),
    click.option("--voxel", callback=length, metavar="LENGTH", help="How fine, such as 0.25mm."),
    click.option(
        "--resolution",
        type=int,
        metavar="N",
        help="How fine, as voxels along the longest side; 256 if neither is given.",
    ),
    click.option(
        "--dust",
        type=float,
        callback=amount,
        metavar="MM3",
        help="Drop bodies with less; 1e-5 of the whole by default.",
    ),
    click.option(
        "--chord",
        callback=length,
        metavar="LENGTH",
        help="More triangles where the surface bends farther than this from them, such as 0.001mm.",
    ),
    click.option(
        "--simplify",
        callback=length,
        metavar="LENGTH",
        help="Fewer triangles, nowhere farther off than this, such as 0.02mm.",
    ),
]


def print_value(context: click.Context, option: click.Parameter, text: str | None) -> Any:
    """What an attribute of `<print>` would be with this text."""
    from fracslice.scene import Print

    try:
        return None if text is None else Print.kinds()[str(option.name)].read(text)
    except ValueError as error:
        raise click.BadParameter(f"{text!r}: expected {error}") from None


def print_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """What makes the object printable: adds the options that `printing_of` takes."""
    for name, metavar, text in reversed(_PRINT):
        command = click.option(f"--{name}", callback=print_value, metavar=metavar, help=text)(command)
    return command


_PRINT = [
    ("cavities", "keep|fill", "Sealed hollows stay or are filled."),
    ("keep", "all|largest", "All bodies, or one."),
    ("bridge", "LENGTH", "Join loose bodies by struts this thick."),
    ("gap", "LENGTH", "Close gaps up to this width."),
    ("thickness", "LENGTH", "Thicken what is thinner."),
    ("hollow", "LENGTH", "Hollow it out; walls of this thickness."),
    ("drain", "LENGTH", "Drain holes of a hollow, 3mm by default; 0: none."),
    ("base", "LENGTH", "Cut off this much at the bottom, to stand flat."),
    ("raft", "LENGTH", "Stand it on a plate of this height."),
]
"""The attributes of `<print>`; each option overrides the scene's."""


def printing_of(scene: Scene, options: dict[str, Any]) -> Print:
    """What the scene says, overridden by the options that are given."""
    names = [name for name, *_ in _PRINT]
    return replace(scene.printing, **{n: options[n] for n in names if options[n] is not None})


set_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME.ATTRIBUTE=VALUE",
    help="Change a value, as mandelbulb.power=6.",
)
threads_option = click.option(
    "--threads",
    type=click.IntRange(1, 1024),
    default=os.cpu_count() or 1,
    metavar="N",
    help="All cores by default.",
)
device_option = click.option(
    "--device", type=click.Choice(["cpu", "cuda", "auto"]), default="auto", help="What computes it."
)
quiet_option = click.option("--quiet", "-q", is_flag=True, help="No progress, no summary.")


def job_of(
    scene: Scene, size: float | None, voxel: float | None, resolution: int | None, **others: Any
) -> MeshJob:
    """The job that the options ask for."""
    from fracslice.job import MeshJob

    return MeshJob(
        size_mm=size,
        voxel_mm=voxel,
        resolution=resolution,
        dust_mm3=others["dust"],
        printing=printing_of(scene, others),
        chord_mm=others["chord"],
        simplify_mm=others["simplify"],
    )
