"""Options of layers, which `slice` and `check` share."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from .options import PreparationOptions, option
from .value_types import LENGTH, Name, Parsed, read_length

if TYPE_CHECKING:
    from fracslice.slicing import Stack
    from fracslice.slicing.layer_checks import PrintReport
    from fracslice.slicing.printers import Printer
    from fracslice.work import Work

LAYER, PIXEL_MM = "0.05mm", 0.05


def read_shift(text: str) -> float:
    """Parse a length, zero or negative ones included, into mm."""
    from fracslice.scene.lengths import Shift

    return float(Shift(0.0, "").read(text))


def read_heights(text: str) -> tuple[float, float | None]:
    """Parse a layer height into mm, or the minimum and maximum of adaptive layers."""
    low, dots, high = text.partition("..")
    return read_length(low), read_length(high) if dots else None


def printer(context: click.Context, _: click.Parameter, name: str | None) -> Printer | None:
    """Look up a printer by name; "list" prints all printers and ends the command."""
    from fracslice.slicing import printers

    if name != "list":
        return None if name is None else printers.printer(name)
    for p in printers.PRINTERS.values():
        volume = " x ".join(f"{r:g}" for r in p.build_volume)
        click.echo(f"{p.name:20} {p.title:30} {p.pixels[0]} x {p.pixels[1]}, {volume} mm, .{p.file}")
    context.exit()


def layer_option(text: str, **settings: Any) -> Any:
    """Declare --layer, a height or a range of heights."""
    return option(Parsed(read_heights, "LENGTH[..LENGTH]"), text, **settings)


def printer_option(text: str) -> Any:
    """Declare --printer, looked up before missing options are reported."""
    return option(str, text, "--printer", metavar="NAME|FILE", callback=printer, is_eager=True)


class LayerOptions(PreparationOptions):
    """Options of layers."""

    layer: tuple[float, float | None]
    machine: Printer | None
    pixel: float | None = option(LENGTH, "Pixel size; the printer's by default, or 0.05mm.")
    html: str | None = option(
        Name("FILE.html", ".html"),
        "Write a page: figures, problems, pictures of the worst layers, cross-section over height.",
    )

    @property
    def pixels(self) -> tuple[float, float]:
        """Pixel size, mm: that of --pixel or of --printer, which exclude each other."""
        pixel, machine = self.pixel, self.machine
        if pixel is not None and machine is not None:
            raise click.UsageError("--pixel and --printer: expected one of them")
        return (pixel, pixel) if pixel else machine.pixel if machine else (PIXEL_MM, PIXEL_MM)


def write_page(
    stack: Stack, report: PrintReport, lines: Sequence[str], title: str, path: str, work: Work
) -> None:
    """Write the summary page of layers that were checked."""
    import numpy as np

    from fracslice.export import replacing
    from fracslice.export.page import page
    from fracslice.printing.problems import verdict
    from fracslice.slicing.preview import worst_layers

    with io.BytesIO() as picture, replacing(path) as file:
        worst_layers(stack, report.worst, picture, work)
        problems = [str(problem) for problem in report.problems]
        areas, worst = np.array(report.areas), picture.getvalue()
        file.write(page(title, lines, verdict(report.problems), problems, stack.tops, areas, worst))
