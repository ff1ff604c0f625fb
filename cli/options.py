"""The options that commands share, and the kinds of values they take."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from fracslice.errors import SceneError

if TYPE_CHECKING:
    from fracslice.job import MeshJob


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
    click.option("--keep", type=click.Choice(["all", "largest"]), default="all", help="All bodies, or one."),
    click.option(
        "--dust",
        type=float,
        callback=amount,
        metavar="MM3",
        help="Drop bodies with less; 1e-5 of the whole by default.",
    ),
    click.option(
        "--cavities",
        type=click.Choice(["keep", "fill"]),
        default="keep",
        help="Sealed hollows stay or are filled.",
    ),
    click.option(
        "--base", callback=length, metavar="LENGTH", help="Cut off this much at the bottom, to stand flat."
    ),
]

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
quiet_option = click.option("--quiet", "-q", is_flag=True, help="No progress, no summary.")


def job_of(size: float | None, voxel: float | None, resolution: int | None, **others: Any) -> MeshJob:
    """The job that the options ask for."""
    from fracslice.job import MeshJob

    return MeshJob(
        size_mm=size,
        voxel_mm=voxel,
        resolution=resolution,
        keep=others["keep"],
        dust_mm3=others["dust"],
        cavities=others["cavities"],
        base_mm=others["base"] or 0.0,
    )
