"""Options of layers, which `slice` and `check` share."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import click

from .options import NAME, length, parsed

if TYPE_CHECKING:
    from fracslice.slicing import Stack
    from fracslice.slicing.checks import PrintReport
    from fracslice.slicing.printers import Printer
    from fracslice.work import Work

LAYER, PIXEL_MM = "0.05mm", 0.05


def shift(_: click.Context, __: click.Parameter, text: str) -> float:
    """Parse a length, zero or negative ones included, into mm."""
    from fracslice.scene.lengths import Shift

    distance: float = parsed(text, Shift(0.0, ""))
    return distance


def heights(
    context: click.Context, option: click.Parameter, text: str | None
) -> tuple[float, float | None] | None:
    """Parse a layer height into mm, or the minimum and maximum of adaptive layers."""
    if text is None:
        return None
    low, _, high = text.partition("..")
    least = length(context, option, low)
    assert least is not None
    return least, length(context, option, high) if ".." in text else None


def printer(context: click.Context, _: click.Parameter, name: str | None) -> Printer | None:
    """Look up a printer by name; "list" prints all printers and ends the command."""
    from fracslice.slicing import printers

    if name != "list":
        return None if name is None else printers.printer(name)
    for p in printers.PRINTERS.values():
        volume = " x ".join(f"{r:g}" for r in p.build_volume)
        click.echo(f"{p.name:20} {p.title:30} {p.pixels[0]} x {p.pixels[1]}, {volume} mm, .{p.file}")
    context.exit()


def ending(*endings: str) -> Callable[..., str | None]:
    """Callback that checks the extension of a file."""

    def checked(_: click.Context, __: click.Parameter, path: str | None) -> str | None:
        if path is not None and not path.lower().endswith(endings):
            raise click.BadParameter(f"{path}: expected a file name that ends in {' or '.join(endings)}")
        return path

    return checked


def pixel_of(options: dict[str, Any]) -> tuple[float, float]:
    """Pixel size, mm: that of --pixel or of --printer, which exclude each other."""
    pixel, machine = options["pixel"], options["machine"]
    if pixel is not None and machine is not None:
        raise click.UsageError("--pixel and --printer: expected one of them")
    return (pixel, pixel) if pixel else machine.pixel if machine else (PIXEL_MM, PIXEL_MM)


def printer_option(text: str) -> Callable[..., Any]:
    """Decorator that adds --printer, parsed before missing options are reported. text: its help."""
    names = "--printer", "machine"
    return click.option(*names, callback=printer, is_eager=True, metavar="NAME|FILE", help=text)


html_option = click.option(
    "--html",
    type=NAME,
    callback=ending(".html"),
    metavar="FILE.html",
    help="Write a page: figures, problems, pictures of the worst layers, cross-section over height.",
)


def write_page(
    stack: Stack, report: PrintReport, lines: Sequence[str], title: str, path: str, work: Work
) -> None:
    """Write the summary page of layers that were checked."""
    import numpy as np

    from fracslice.export import replacing
    from fracslice.export.page import page
    from fracslice.slicing.preview import worst_layers

    with io.BytesIO() as picture, replacing(path) as file:
        worst_layers(stack, report.worst, picture, work)
        problems = [str(problem) for problem in report.problems]
        file.write(page(title, lines, problems, stack.tops, np.array(report.areas), picture.getvalue()))


def as_high_as_wanted(stack: Stack, options: dict[str, Any], work: Work) -> Stack:
    """Adaptive layers if a range of heights is given; otherwise the stack itself."""
    from fracslice.slicing import adapted

    most = options["layer"][1]
    return stack if most is None else adapted(stack, most, work)
