"""Options of commands: records that click fills."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import click

from fracslice.errors import VolumeError

from .value_types import AMOUNT, FACTORS, LENGTH, NUMBER, Name, PrintSetting, Whole, direction
from .working import NOTHING, working

if TYPE_CHECKING:
    from fracslice.meshjob import MeshJob
    from fracslice.scene import Print, Scene
    from fracslice.work import Work

R = TypeVar("R", bound="CommandOptions")


def argument(metavar: str, **settings: Any) -> Any:
    """Declare an argument, the name of a file, as an attribute of a record."""
    return partial(_parameter, click.Argument, (), type=Name(), metavar=metavar, **settings)


def output(metavar: str, text: str, *endings: str) -> Any:
    """Declare the file or folder that the command writes as an attribute of a record."""
    return option(Name(metavar, *endings), text, "-o", "--output", required=True)


def option(kind: Any, text: str, *names: str, **settings: Any) -> Any:
    """Declare an option as an attribute of a record.

    Parameters
    ----------
    kind : click.ParamType
        Type of the value; its attribute `metavar`, if it has one, names the value in the help.
    text : str
        Help.
    *names : str
        The option; by default two dashes and the attribute's name.
    **settings
        Further arguments of `click.Option`.
    """
    shown = {"metavar": getattr(kind, "metavar", None)}
    return partial(_parameter, click.Option, names, type=kind, help=text, **{**shown, **settings})


def flag(text: str, *names: str) -> Any:
    """Declare an option without a value as an attribute of a record."""
    return partial(_parameter, click.Option, names, is_flag=True, help=text)


def _parameter(kind: type[click.Parameter], names: Sequence[str], name: str, **settings: Any) -> Any:
    names = names or ([f"--{name.replace('_', '-')}"] if kind is click.Option else [])
    return kind([*names, name], **settings)


DEVICE = option(
    click.Choice(["cpu", "cuda", "auto"]),
    "The device that computes; auto by default: the GPU, if there is one and starting it pays.",
    default="auto",
)
SAMPLES = option(Whole(1, 1_000_000), "Maximum number of samples per pixel; the scene's by default, or 64.")


def run_formulas(context: click.Context, option: click.Parameter, files: Sequence[str]) -> None:
    """Run the files of --formulas before the scene is read."""
    for file in files:
        from fracslice.formulas.plugins import run_file

        run_file(file)


class CommandOptions:
    """Values of a command's arguments and options, each declared as an attribute of a subclass."""

    formulas: None = option(
        str,
        "A Python file that registers formulas of your own; it is run. Repeatable.",
        metavar="FILE",
        multiple=True,
        is_eager=True,
        expose_value=False,
        callback=run_formulas,
    )

    def __init__(self, **values: Any) -> None:
        vars(self).update(values)

    def but(self: R, **values: Any) -> R:
        """Copy with other values."""
        return type(self)(**{**vars(self), **values})

    @classmethod
    def parameters(cls) -> list[click.Parameter]:
        """Parameters of click: those of the class, then those of its bases."""
        declared: dict[str, Any] = {}
        for owner in cls.__mro__:
            for name, value in vars(owner).items():
                if isinstance(value, partial):
                    declared.setdefault(name, value)
        return [make(name=name) for name, make in declared.items()]


def named(function: Callable[[R], int | None], given: R) -> int | None:
    """Run a command; errors of a volume, which has no file, name the file or scene of the command."""
    try:
        return function(given)
    except VolumeError as error:
        source = getattr(given, "source", "")
        raise type(error)(f"{source}: {error}" if source else str(error)) from error


def command(
    record: type[R], name: str | None = None, short_help: str | None = None
) -> Callable[[Callable[[R], int | None]], click.Command]:
    """Decorator of a function of a record: makes it a command with the record's options.

    The function's docstring is the help; the lines of its section Examples end it.
    """

    def decorated(function: Callable[[R], int | None]) -> click.Command:
        text, _, examples = (inspect.getdoc(function) or "").partition("\n\nExamples\n--------\n")
        return click.Command(
            name or function.__name__,
            callback=lambda **values: named(function, record(**values)),
            params=record.parameters(),
            help=text,
            epilog=f"\b\nExamples:\n  {examples.replace(chr(10), f'{chr(10)}  ')}",
            short_help=short_help,
        )

    return decorated


class RunOptions(CommandOptions):
    """Execution."""

    threads: int = option(
        Whole(1, 1024), "Number of threads; one for each core by default.", default=os.cpu_count() or 1
    )
    quiet: bool = flag("No progress, no summary.", "-q", "--quiet")

    def working(self, kept: str = NOTHING, **settings: Any) -> AbstractContextManager[Work]:
        """Work with these threads and other settings, as `working` runs it."""
        from fracslice.work import Work

        return working(Work(self.threads, **settings), self.quiet, kept)


class SceneOptions(RunOptions):
    """Values of the scene."""

    settings: tuple[str, ...] = option(
        str,
        "Change a value of the scene, such as mandelbulb.power=6; repeatable. mesh, slice and render take a "
        "range, such as mandelbulb.power=2..9:0.5 or box.size=1 1 1..3, and make a file for each value.",
        "--set",
        metavar="NAME.ATTRIBUTE=VALUE",
        multiple=True,
    )


class PlacementOptions(SceneOptions):
    """Size and orientation of an object."""

    size: float | None = option(
        LENGTH, "The longest side, such as 80mm, 8cm or 3.1in; the scene's by default."
    )
    up: tuple[float, float, float] = option(
        NUMBER,
        "The object's direction that is up; 0 0 1 by default.",
        metavar="X Y Z",
        nargs=3,
        default=(0.0, 0.0, 1.0),
        callback=direction,
    )
    scale: tuple[float, float, float] = option(
        FACTORS,
        "Compensate shrinkage: 102%, or 102%,102%,101% along x, y and z; 100% by default.",
        default="100%",
    )


_SETTING = PrintSetting()


class PreparationOptions(PlacementOptions):
    """Print preparation: attributes of `<print>`; each option overrides the scene's."""

    cavities: Any = option(
        _SETTING, "Keep sealed cavities, or fill them; keep by default.", metavar="keep|fill"
    )
    keep: Any = option(
        _SETTING,
        "Keep all connected components, the largest or N of them; all by default.",
        metavar="all|largest|N",
    )
    bridge: Any = option(_SETTING, "Join connected components by struts of this diameter.")
    gap: Any = option(_SETTING, "Close gaps up to this width.")
    thickness: Any = option(_SETTING, "Thicken thinner walls to this.")
    hollow: Any = option(_SETTING, "Hollow the object, leaving walls of this thickness.")
    drain: Any = option(_SETTING, "Diameter of the drain holes of a hollow, 3mm by default; 0: none.")
    base: Any = option(_SETTING, "Cut off this much at the bottom, to stand flat.")
    raft: Any = option(_SETTING, "Put the object on a plate of this height.")

    def printing(self, given: Print) -> Print:
        """Print settings, overridden by those of the options."""
        own = {name: getattr(self, name) for name in given.kinds()}
        changed = replace(given, **{name: value for name, value in own.items() if value is not None})
        if self.drain is not None and not changed.hollow:
            raise click.UsageError("--drain: expected --hollow, or a hollow in the scene's <print>")
        return changed


class MeshOptions(PreparationOptions):
    """Resolution and refinement of a mesh."""

    voxel: float | None = option(LENGTH, "Voxel size, such as 0.25mm.")
    resolution: int | None = option(
        Whole(8, 16384), "Voxels along the longest side, instead of --voxel; 256 by default."
    )
    dust: float | None = option(
        AMOUNT,
        "Drop bodies of less volume, in mm3; 1e-5 of the whole, at least half a voxel, by default.",
        metavar="MM3",
    )
    chord: float | None = option(
        LENGTH, "Split triangles farther than this from a smooth surface, such as 0.001mm."
    )
    simplify: float | None = option(LENGTH, "Remove triangles within this tolerance, such as 0.02mm.")
    proved: bool = flag("Skip space by proofs only, not by the measured bounds of fractals.")

    def job(self, scene: Scene) -> MeshJob:
        """Mesh job of a scene."""
        from fracslice.meshjob import MeshJob

        return MeshJob(
            size_mm=self.size,
            voxel_mm=self.voxel,
            resolution=self.resolution,
            dust_mm3=self.dust,
            printing=self.printing(scene.printing),
            chord_mm=self.chord,
            simplify_mm=self.simplify,
            up=self.up,
            scale=self.scale,
            proved=self.proved,
        )
