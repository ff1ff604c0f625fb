"""Options of commands: records that click fills, the types of their values, and the options that commands
share.
"""

from __future__ import annotations

import inspect
import io
import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, TypeVar

import click

from fracslice.common.parameters import (
    Choice,
    Colours,
    Count,
    Duration,
    Flag,
    Heights,
    Holes,
    Listed,
    Number,
    Parameter,
    Percent,
    Pixels,
    Record,
    Sides,
    Vector,
    parse_length,
    picture_size,
)
from fracslice.errors import ClusterError, SceneError, VolumeError
from fracslice.records import MeshJob, Part, Placed, Print, RasterOptions, SliceJob

from .execution import DENSITIES, NOTHING, BadInput, refuse_options, working

if TYPE_CHECKING:
    from fracslice.checks.layer_checks import PrintReport
    from fracslice.cluster import Pool
    from fracslice.fields.box import Triple
    from fracslice.scene import Scene
    from fracslice.slicing import Stack
    from fracslice.slicing.printers import Printer
    from fracslice.work import Work


class Name(click.types.StringParamType):
    """Name of a file or folder, with one of some endings."""

    name = "name"

    def __init__(self, metavar: str = "", *endings: str) -> None:
        self.metavar, self.endings = metavar, endings

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> Any:
        if not value:
            self.fail("expected the name of a file, found nothing", option, context)
        if value == "-":
            self.fail(
                "-: expected the name of a file; standard input and output are not used", option, context
            )
        if self.endings and not value.lower().endswith(self.endings):
            endings = " or ".join(self.endings)
            self.fail(f"{value}: expected a file name that ends in {endings}", option, context)
        return value


class Whole(click.IntRange):
    """A whole number within a range."""

    name, metavar = "whole number", "N"

    def _describe_range(self) -> str:
        return "" if self.min is self.max is None else super()._describe_range()


class Finite(click.types.FloatParamType):
    """A number that is neither infinite nor undefined."""

    name, metavar = "number", "N"

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> float:
        number: float = super().convert(value, option, context)
        if not math.isfinite(number):
            self.fail(f"{value}: expected a finite number", option, context)
        return number


class Signed(Finite):
    """A finite number above zero, or at least zero."""

    def __init__(self, relation: str) -> None:
        self.relation = relation

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> float:
        number = super().convert(value, option, context)
        if number < 0 or (number == 0 and self.relation == ">"):
            self.fail(f"{number:g}: expected a number {self.relation} 0", option, context)
        return number


class Parsed(click.types.StringParamType):
    """A value that a function parses; the message of its `ValueError` names what it expects."""

    name = "text"

    def __init__(self, parse: Callable[[str], Any], metavar: str) -> None:
        self.parse, self.metavar = parse, metavar

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> Any:
        try:
            return self.parse(value)
        except SceneError as error:
            self.fail(str(error), option, context)
        except ValueError as error:
            self.fail(f"{value!r}: expected {error}", option, context)


class OfKind(click.types.StringParamType):
    """A value of a parameter kind."""

    name = "text"

    def __init__(self, kind: Parameter) -> None:
        self.kind, self.metavar = kind, metavar(kind)

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> Any:
        try:
            return self.kind.read(value) if isinstance(value, str) else value
        except ValueError as error:
            self.fail(f"{value!r}: expected {error}", option, context)


def metavar(kind: Parameter) -> str:
    """What stands for a value in the help."""
    if isinstance(kind, Count):
        return "|".join([*kind.words, "N"])
    if isinstance(kind, Colours):
        return "N|COLOUR,..." if kind.counted else "NAME|COLOUR,..."
    if isinstance(kind, Choice | Listed):
        return "|".join(map(str, kind.choices if isinstance(kind, Choice) else kind.values))
    if isinstance(kind, Heights):
        return "LENGTH[..LENGTH]"
    if isinstance(kind, Number | Vector):
        return kind.unit.upper() or ("N" if isinstance(kind, Number) else "X Y Z")
    if isinstance(kind, Pixels):
        return kind.letters
    if isinstance(kind, Sides):
        return "WxD[xH]" if kind.flat else "WxDxH"
    if isinstance(kind, Holes):
        return f"X,Y,Z|{kind.WORD}"
    names = {Percent: "N%[,N%,N%]", Duration: "TIME"}
    return names.get(type(kind), "LENGTH")


def kind_option(kind: Parameter, default: Any, text: str = "") -> Any:
    """Declare an option of a parameter kind, whose documentation is the help."""
    text = text or kind.doc[0].upper() + kind.doc[1:]
    if isinstance(kind, Flag):
        return flag(f"{text}.")
    usual = "" if kind.default is None else kind.text(kind.default)
    text += f"; {usual} by default." if usual and usual not in ("0mm", "0") and "default" not in text else "."
    if isinstance(kind, Holes):
        return option(OfKind(kind), f"{text} Repeatable.", multiple=True, callback=partial(gathered, kind))
    if isinstance(kind, Vector):
        return option(
            NUMBER, text, metavar="X Y Z", nargs=3, default=default, callback=partial(checked, kind)
        )
    return option(OfKind(kind), text, default=default)


def checked(kind: Parameter, _: click.Context, __: click.Parameter, value: Any) -> Any:
    """Check a value of several words."""
    try:
        return kind.check(value)
    except ValueError as error:
        raise click.BadParameter(f"{kind.text(value)}: expected {error}") from None


def gathered(kind: Holes, _: click.Context, __: click.Parameter, values: Sequence[Any]) -> Any:
    """Holes of a repeated option."""
    if kind.WORD in values and len(values) > 1:
        raise click.BadParameter(f"{kind.WORD}: expected it alone, or places")
    return (kind.WORD if kind.WORD in values else sum(values, ())) if values else None


def read_seconds(text: str) -> float:
    """Parse a time of an animation."""
    from fracslice.scene.view import Seconds

    return float(Seconds(0.0, "").read(text))


def read_interval(text: str) -> float:
    """Parse a time above zero of an animation."""
    seconds = read_seconds(text)
    if not seconds:
        raise ValueError("a time in seconds above zero, such as 2.5s")
    return seconds


NUMBER, AMOUNT, POSITIVE = Finite(), Signed(">="), Signed(">")
LENGTH, SECONDS = Parsed(parse_length, "LENGTH"), Parsed(read_seconds, "TIME")
INTERVAL = Parsed(read_interval, "TIME")


R = TypeVar("R", bound="CommandOptions")
Records: TypeAlias = tuple[type[Record], ...]


def argument(metavar: str, **settings: Any) -> Any:
    """Declare an argument, the name of a file, as an attribute of a record."""
    return partial(_parameter, click.Argument, (), type=Name(), metavar=metavar, **settings)


def output(metavar: str, text: str, *endings: str) -> Any:
    """Declare the file or folder that the command writes as an attribute of a record."""
    return option(Name(metavar, *endings), text, "-o", "--output", required=True)


def option(kind: Any, text: str, *names: str, **settings: Any) -> Any:
    """Declare an option as an attribute of a record."""
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


def run_formulas(context: click.Context, option: click.Parameter, files: Sequence[str]) -> None:
    """Run the files of --formulas before the scene is read."""
    for file in files:
        from fracslice.fields.registry import run_file

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

    records: ClassVar[Records] = ()
    """Records whose fields are options, too."""
    without: ClassVar[frozenset[str]] = frozenset()
    """Fields of the records that are no options of the command."""

    def __init__(self, **values: Any) -> None:
        vars(self).update(values)

    def values(self, record: type[Record]) -> dict[str, Any]:
        """Given values of the fields of a record."""
        return {name: value for name in record.kinds() if (value := vars(self).get(name)) is not None}

    def but(self: R, **values: Any) -> R:
        """Copy with other values."""
        return type(self)(**{**vars(self), **values})

    @classmethod
    def parameters(cls) -> list[click.Parameter]:
        """Parameters of click: those of the class and its records, then those of its bases."""
        declared: dict[str, Any] = {}
        for owner in cls.__mro__:
            for name, value in vars(owner).items():
                if isinstance(value, partial) and (owner is cls or name not in cls.without):
                    declared.setdefault(name, value)
            for record in vars(owner).get("records", ()):
                for name, kind in record.kinds().items():
                    # what is not given leaves a part of the scene as it is
                    default = None if issubclass(record, Part) else kind.default
                    if name not in cls.without:
                        declared.setdefault(name, kind_option(kind, default))
        return [make(name=name) for name, make in declared.items()]


def run_named(function: Callable[[R], int | None], given: R) -> int | None:
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
            callback=lambda **values: run_named(function, record(**values)),
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
    allow_files_outside: bool = flag("Read models that lie outside of the scene's folder, too.")


def up_text(up: Triple) -> str:
    """A direction up as the values of its option."""
    return " ".join(f"{c:g}" for c in up)


class PreparationOptions(SceneOptions):
    """Print preparation; each option overrides the scene's."""

    records: ClassVar[Records] = (Print,)
    size: float | None
    scale: Triple
    orient: str | None = option(
        click.Choice(["auto"]),
        "auto: the best direction up that fracslice orient finds, instead of --up.",
    )

    def oriented(self: R, scene: Scene, work: Work) -> R:
        """These options with the direction up of --orient."""
        if vars(self).get("orient") is None:
            return self
        from fracslice.slicing.orientation import best_up

        given = vars(self)
        refuse_options({"up"}, "--orient finds it; expected one of them")
        up = best_up(scene, Placed(size=given["size"], scale=given["scale"]), work)
        if not given["quiet"]:
            click.echo(f"--up {up_text(up)}", err=True)
        return self.but(up=up, orient=None)

    def printing(self, given: Print) -> Print:
        """Print settings, overridden by those of the options."""
        own = self.values(Print)
        changed = replace(given, **own)
        if "drain" in own and not changed.hollow and not changed.drain_at:
            raise click.UsageError(
                "--drain: expected --hollow, --drain-at, or a hollow in the scene's <print>"
            )
        return changed


HINTS = frozenset({"heights", "paint_supports"})
"""Fields of meshes with hints for slicers."""
FOR_SLICERS = HINTS | {"colour", "palette", "filaments", "bodies"}
"""Fields of meshes with hints for slicers, and with colours."""


MATERIAL = option(
    click.Choice(list(DENSITIES)), "Material of the weight in the summary; resin by default.", default="resin"
)


class MeshOptions(PreparationOptions):
    """Options of meshes without colours."""

    records: ClassVar[Records] = (MeshJob,)
    without = FOR_SLICERS

    def mesh_job(self, scene: Scene) -> MeshJob:
        """Mesh job of a scene."""
        return MeshJob(**self.values(MeshJob), printing=self.printing(scene.printing))


PIXELS = OfKind(picture_size(None, ""))


def printer(context: click.Context, _: click.Parameter, name: str | None) -> Printer | None:
    """Look up a printer by name; "list" prints all printers and ends the command."""
    from fracslice.slicing import printers

    if name != "list":
        return None if name is None else printers.printer(name)
    for p in printers.PRINTERS.values():
        volume = " x ".join(f"{r:g}" for r in p.build_volume)
        click.echo(f"{p.name:20} {p.title:30} {p.pixels[0]} x {p.pixels[1]}, {volume} mm, .{p.file}")
    context.exit()


def printer_option(text: str) -> Any:
    """Declare --printer, looked up before missing options are reported."""
    return option(str, text, "--printer", metavar="NAME|FILE", callback=printer, is_eager=True)


class LayerOptions(PreparationOptions):
    """Options of layers as they are; those of a printer's screen are of `slice`."""

    records: ClassVar[Records] = (SliceJob,)
    without = frozenset(RasterOptions.kinds()) | {"sections"}
    machine: Printer | None
    html: str | None = option(
        Name("FILE.html", ".html"),
        "Write a page: figures, problems, pictures of the worst layers, cross-section over height.",
    )

    def slice_job(self, printing: Print) -> SliceJob:
        """Slice job with these options and print settings."""
        return SliceJob(**self.values(SliceJob), printer=self.machine, printing=printing)


def write_page(
    stack: Stack,
    report: PrintReport,
    lines: Sequence[str],
    title: str,
    path: str,
    work: Work,
    views: Sequence[bytes] = (),
) -> None:
    """Write the summary page of layers that were checked; `views`: pictures of the object, PNG."""
    import numpy as np

    from fracslice.checks.problems import verdict
    from fracslice.common.files import replacing
    from fracslice.slicing.raster import elevations, page, worst_layers

    marks, areas = report.marks(stack.tops), np.array(report.areas)
    with io.BytesIO() as picture, io.BytesIO() as sides, replacing(path) as file:
        worst_layers(stack, report.worst, picture, work)
        elevations(stack, marks, sides, work)
        made = page(
            title,
            [*lines, *filter(None, [report.supports])],
            verdict(report.problems),
            [str(problem) for problem in report.problems],
            stack.tops,
            areas,
            picture.getvalue(),
            sides.getvalue(),
            marks,
            views,
        )
        file.write(made)


class ClusterOptions(RunOptions):
    """Other processes and machines."""

    output: str
    cluster: str | None = option(
        str,
        "Share the job between workers: tcp://HOST:8786, a scheduler of Dask; or local:N processes.",
        metavar="WHERE",
    )
    shard: str | None = option(
        str, "Make the I-th of N shares of the job, such as 3/64; shard 1 writes the file.", metavar="I/N"
    )
    store: str | None = option(
        str,
        "Folder or fsspec URL for pieces, which all machines reach; beside the file by default.",
        metavar="FOLDER",
    )

    @property
    def beside(self) -> str:
        """File beside which pieces are kept by default."""
        return self.output

    @contextmanager
    def working(self, kept: str = NOTHING, **settings: Any) -> Iterator[Work]:
        """Work with the pool of --cluster and --shard."""
        with ExitStack() as stack:
            pool = stack.enter_context(self._pooled())
            with super().working(kept, cluster=pool, **settings) as work:
                yield work
                stack.pop_all().close()  # Ctrl-C while workers end would say that nothing was written

    @contextmanager
    def _pooled(self) -> Iterator[Pool | None]:
        """Pool of the given options; None without --cluster and --shard."""
        if self.cluster and self.shard:
            raise click.UsageError("--cluster and --shard: expected one of them")
        if not self.cluster and not self.shard:
            if self.store:
                raise click.UsageError("--store: needs --cluster or --shard")
            yield None
            return
        from fracslice.cluster import HIDDEN, ResultFolder, Shard, connect

        place = self.store or os.path.join(os.path.dirname(os.path.abspath(self.beside)), HIDDEN)
        place = place if "://" in place else os.path.abspath(place)
        with ExitStack() as stack:
            try:
                pool: Pool = (
                    Shard.read(self.shard, ResultFolder(place))
                    if self.shard
                    else stack.enter_context(connect(str(self.cluster), place, self.threads))
                )
            except ClusterError as error:
                raise BadInput(str(error)) from None
            yield pool
        if not self.shard:
            pool.pieces.tidy()
