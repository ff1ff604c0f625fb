"""Options shared by commands, and their parameter types."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from fracslice.errors import SceneError

if TYPE_CHECKING:
    from fracslice.formulas.parameters import Parameter
    from fracslice.meshjob import MeshJob
    from fracslice.scene import Print, Scene


class Name(click.types.StringParamType):
    """Name of a file or folder."""

    name = "name"

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> Any:
        return value if value else self.fail("expected the name of a file, found nothing", option, context)


class Whole(click.IntRange):
    """A whole number within a range."""

    name = "whole number"


class Finite(click.types.FloatParamType):
    """A number that is neither infinite nor undefined."""

    name = "number"

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> float:
        number: float = super().convert(value, option, context)
        return (
            number
            if math.isfinite(number)
            else self.fail(f"{value}: expected a finite number", option, context)
        )


class Positive(Finite):
    """A finite number above zero."""

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> float:
        number = super().convert(value, option, context)
        return number if number > 0 else self.fail(f"{value}: expected a number > 0", option, context)


NAME, NUMBER, WHOLE = Name(), Finite(), Whole()


def source_argument(metavar: str) -> Callable[..., Any]:
    """Decorator that adds the input of the command."""
    return click.argument("source", type=NAME, metavar=metavar)


def output_option(metavar: str, text: str) -> Callable[..., Any]:
    """Decorator that adds the file or folder that the command writes."""
    return click.option("-o", "--output", type=NAME, required=True, metavar=metavar, help=text)


def length(_: click.Context, __: click.Parameter, value: str | None) -> float | None:
    """Parse a length into mm."""
    if value is None:
        return None
    from fracslice.scene import parse_length

    try:
        return parse_length(value)
    except SceneError as error:
        raise click.BadParameter(str(error)) from None


def parsed(text: str, kind: Parameter) -> Any:
    """Value that a text spells, of a parameter kind."""
    try:
        return kind.read(text)
    except ValueError as error:
        raise click.BadParameter(f"{text!r}: expected {error}") from None


def moment(_: click.Context, __: click.Parameter, text: str | None) -> float | None:
    """Parse a time of an animation into seconds."""
    from fracslice.scene.animation import Seconds

    return None if text is None else parsed(text, Seconds(0.0, ""))


def amount(_: click.Context, __: click.Parameter, value: float | None) -> float | None:
    """Check that a number is at least zero."""
    if value is not None and value < 0:
        raise click.BadParameter(f"{value:g}: expected a number >= 0")
    return value


def direction(
    _: click.Context, __: click.Parameter, value: tuple[float, float, float] | None
) -> tuple[float, float, float]:
    """Check a direction; up without one."""
    if value is not None and not any(value):
        raise click.BadParameter("0 0 0: expected a direction")
    return value or (0.0, 0.0, 1.0)


def factors(_: click.Context, __: click.Parameter, text: str | None) -> tuple[float, ...]:
    """Parse the compensation of shrinkage into factors along x, y and z."""
    from fracslice.scene.lengths import Percent

    factors: tuple[float, ...] = parsed(text or "100%", Percent(None, ""))
    return factors


def job_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator that adds the mesh options, which `job_of` takes."""
    for option in reversed(_JOB):
        command = option(command)
    return command


size_option = click.option(
    "--size",
    callback=length,
    metavar="LENGTH",
    help="The longest side, such as 80mm, 8cm or 3.1in; the scene's by default.",
)
up_option = click.option(
    "--up",
    nargs=3,
    type=NUMBER,
    callback=direction,
    metavar="X Y Z",
    help="The object's direction that is up; 0 0 1 by default.",
)
scale_option = click.option(
    "--scale",
    callback=factors,
    metavar="N%[,N%,N%]",
    help="Compensate shrinkage: 102%, or 102%,102%,101% along x, y and z; 100% by default.",
)

_JOB = [
    size_option,
    up_option,
    scale_option,
    click.option("--voxel", callback=length, metavar="LENGTH", help="Voxel size, such as 0.25mm."),
    click.option(
        "--resolution",
        type=WHOLE,
        metavar="N",
        help="Voxels along the longest side, instead of --voxel: 8 to 16384; 256 by default.",
    ),
    click.option(
        "--dust",
        type=NUMBER,
        callback=amount,
        metavar="MM3",
        help="Drop connected components of less volume, in mm3; 1e-5 of the whole by default.",
    ),
    click.option(
        "--chord",
        callback=length,
        metavar="LENGTH",
        help="Split triangles farther than this from a smooth surface, such as 0.001mm.",
    ),
    click.option(
        "--simplify",
        callback=length,
        metavar="LENGTH",
        help="Remove triangles within this tolerance, such as 0.02mm.",
    ),
    click.option(
        "--proved",
        is_flag=True,
        help="Skip space by proofs only, not by the measured bounds of fractals.",
    ),
]


def print_value(context: click.Context, option: click.Parameter, text: str | None) -> Any:
    """Parse the value of an attribute of `<print>`."""
    if text is None:
        return None
    from fracslice.scene import Print

    return parsed(text, Print.kinds()[str(option.name)])


def print_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator that adds the print preparation options, which `printing_of` takes."""
    for name, metavar, text in reversed(_PRINT):
        command = click.option(f"--{name}", callback=print_value, metavar=metavar, help=text)(command)
    return command


_PRINT = [
    ("cavities", "keep|fill", "Keep sealed cavities, or fill them; keep by default."),
    ("keep", "all|largest", "Keep all connected components, or only the largest; all by default."),
    ("bridge", "LENGTH", "Join connected components by struts of this diameter."),
    ("gap", "LENGTH", "Close gaps up to this width."),
    ("thickness", "LENGTH", "Thicken thinner walls to this."),
    ("hollow", "LENGTH", "Hollow the object, leaving walls of this thickness."),
    ("drain", "LENGTH", "Diameter of the drain holes of a hollow, 3mm by default; 0: none."),
    ("base", "LENGTH", "Cut off this much at the bottom, to stand flat."),
    ("raft", "LENGTH", "Put the object on a plate of this height."),
]
"""Attributes of `<print>`; each option overrides the scene's."""


def printing_of(scene: Scene, options: dict[str, Any]) -> Print:
    """Print settings of the scene, overridden by the given options."""
    names = [name for name, *_ in _PRINT]
    return replace(scene.printing, **{n: options[n] for n in names if options[n] is not None})


def price_option(of: str) -> Callable[..., Any]:
    """Decorator that adds --price, the price of a unit of material."""
    return click.option("--price", type=NUMBER, callback=amount, metavar="N", help=f"Price of a {of}.")


set_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME.ATTRIBUTE=VALUE",
    help="Change a value of the scene, such as mandelbulb.power=6; repeatable. mesh, slice and render take a "
    "range, such as mandelbulb.power=2..9:0.5, and make a file for each value.",
)
threads_option = click.option(
    "--threads",
    type=Whole(1, 1024),
    default=os.cpu_count() or 1,
    metavar="N",
    help="Number of threads; one for each core by default.",
)
device_option = click.option(
    "--device",
    type=click.Choice(["cpu", "cuda", "auto"]),
    default="auto",
    help="The device that computes; auto by default: the GPU, if there is one.",
)
samples_option = click.option(
    "--samples",
    type=Whole(1, 1_000_000),
    metavar="N",
    help="Maximum number of samples per pixel; the scene's by default, or 64.",
)
quiet_option = click.option("--quiet", "-q", is_flag=True, help="No progress, no summary.")


def run_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator that adds the options of every command that runs a scene."""
    return set_option(threads_option(quiet_option(command)))


def job_of(
    scene: Scene, size: float | None, voxel: float | None, resolution: int | None, **others: Any
) -> MeshJob:
    """Mesh job with the given options."""
    from fracslice.meshjob import MeshJob

    return MeshJob(
        size_mm=size,
        voxel_mm=voxel,
        resolution=resolution,
        dust_mm3=others["dust"],
        printing=printing_of(scene, others),
        chord_mm=others["chord"],
        simplify_mm=others["simplify"],
        up=others["up"],
        scale=others["scale"],
        proved=others["proved"],
    )
