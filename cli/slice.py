"""fracslice slice: writing the layers of a print."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .cluster import cluster_options, pooled
from .families import families
from .inputs import check_targets, load_scene
from .options import (
    NAME,
    NUMBER,
    length,
    print_options,
    printing_of,
    quiet_option,
    set_option,
    source_argument,
    threads_option,
)
from .working import working

if TYPE_CHECKING:
    from fracslice.export.resins import Resin
    from fracslice.scene import Scene
    from fracslice.slicing import SliceJob, Stack
    from fracslice.slicing.printers import Printer
    from fracslice.work import Work

LAYER, PIXEL_MM = "0.05mm", 0.05


def shift(_: click.Context, __: click.Parameter, text: str) -> float:
    """Parse a length, zero or negative ones included, into mm."""
    from fracslice.scene.lengths import Shift

    try:
        return Shift(0.0, "").read(text)
    except ValueError as error:
        raise click.BadParameter(f"{text!r}: expected {error}") from None


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


def printer_option(text: str) -> Callable[..., Any]:
    """Decorator that adds --printer, parsed before missing options are reported. text: its help."""
    names = "--printer", "machine"
    return click.option(*names, callback=printer, is_eager=True, metavar="NAME|FILE", help=text)


@click.command("slice")
@source_argument("SCENE")
@click.option(
    "-o",
    "--output",
    type=NAME,
    required=True,
    metavar="OUT",
    help="A printer's file (.sl1, .goo, .ctb, .cbddlp, .pwmx, .nanodlp, ...), an .svg, .3mf, .cli or .json "
    "file, or a folder of PNG pictures.",
)
@click.option(
    "--format",
    "form",
    metavar="NAME",
    help="png, sl1, goo, ctb, cbddlp, pwmx, nanodlp, 3mf, svg, slic3r, cli, cli-binary or json; by default, "
    "that of the extension of OUT.",
)
@click.option(
    "--size",
    callback=length,
    metavar="LENGTH",
    help="The longest side, such as 80mm; the scene's by default.",
)
@click.option(
    "--layer",
    callback=heights,
    default=LAYER,
    metavar="LENGTH[..LENGTH]",
    help="Layer height, 0.05mm by default; or a range, 0.05mm..0.2mm: thick where the surface is steep.",
)
@click.option(
    "--pixel", callback=length, metavar="LENGTH", help="Pixel size; the printer's by default, or 0.05mm."
)
@printer_option('The printer whose screen the layers are for, or a .toml file of it; "list" shows all.')
@click.option(
    "--up",
    nargs=3,
    type=NUMBER,
    metavar="X Y Z",
    help="The scene's direction that is up; 0 0 1 by default.",
)
@click.option(
    "--compensation",
    callback=shift,
    default="0",
    metavar="LENGTH",
    help="Move all outlines outwards by this, or inwards if it is negative; at most 1mm, 0 by default.",
)
@click.option("--gamma", type=NUMBER, default=1.0, metavar="N", help="Gamma of grey levels; 1 by default.")
@click.option(
    "--mirror/--no-mirror", default=None, help="Mirror along x; as the printer needs it by default."
)
@click.option(
    "--sections",
    type=click.Choice(["1", "2", "4", "8"]),
    default="1",
    help="Sections per layer, for grey from z: the share of the layer's height that is inside; 1 by default.",
)
@click.option(
    "--exposure",
    nargs=2,
    type=NUMBER,
    metavar="S S",
    help="Exposure in a printer's file: seconds of each layer and of a bottom layer; the resin's by default.",
)
@click.option(
    "--resin",
    type=NAME,
    metavar="NAME|FILE",
    help='A resin such as "Siraya Tech Fast Grey", or a file of its settings: .toml, or .ini of PrusaSlicer.',
)
@click.option(
    "--preview",
    type=NAME,
    metavar="FILE",
    help="Write a contact sheet (.png) or an animation (.webp) of the layers.",
)
@cluster_options
@print_options
@set_option
@threads_option
@quiet_option
@families("output", "preview")
def slice_(
    source: str,
    output: str,
    form: str | None,
    settings: tuple[str, ...],
    threads: int,
    quiet: bool,
    **options: Any,
) -> int:
    """Cut SCENE into the layers of a print, straight from its field.

    An interrupted job resumes when it is started again.
    """
    from fracslice.export.slices import PICTURES, PRINTS, printers_file, slice_format, write_slices
    from fracslice.scene.writer import to_xml
    from fracslice.shown import layers_amount
    from fracslice.slicerecipe import SliceRecipe
    from fracslice.work import Work

    kind, resin = slice_format(output, form), resin_of(options)
    if options["sections"] != "1" and kind not in PICTURES:
        raise click.UsageError(f"{output}: --sections is for pictures; contours are of one section per layer")
    if kind in PRINTS:
        refuse_what_no_print_has(output, kind, options, resin)
    preview = options["preview"]
    if preview and Path(preview).suffix.lower() not in (".png", ".webp"):
        raise click.UsageError(f"{preview}: expected a file name that ends in .png or .webp")
    check_targets(source, None if Path(output).is_dir() else output, preview)
    scene = load_scene(source, settings)
    recipe = SliceRecipe(
        to_xml(scene),
        scene.name,
        job(scene, options),
        options["layer"][1],
        Path(output).name,
        kind,
        options["machine"],
        options["compensation"],
        options["gamma"],
        options["mirror"],
        resin,
        created(),
        int(options["sections"]),
    )
    shared = (options[name] for name in ("cluster", "shard", "store"))
    with pooled(output, threads, *shared) as pool, working(Work(threads, cluster=pool), quiet) as work:
        run = recipe.run(work)
        stack, screen = run.stack, run.screen
        write_slices(run, output, form)
        if preview:
            write_preview(stack, preview, work)
        off = () if quiet else layers_amount(run.slicer, work)[1]
    if not quiet:
        size = " x ".join(f"{s:.2f}" for s in stack.size)
        rows, columns = screen.shape
        click.echo(f"{output}: {len(stack.z)} layers of {columns} x {rows} pixels, {size} mm")
        other = printers_file(screen.printer, output) if screen.printer else ""
        for note in stack.notes + off + ((other,) if other else ()):
            click.echo(note)
    return 0


def resin_of(options: dict[str, Any]) -> Resin | None:
    """Exposure and motion of --resin, else of the printer's own; --exposure changes them. None if there is
    neither.
    """
    from fracslice.export.resins import Resin, default_resin, moving, resin

    machine, layer = options["machine"], options["layer"][0]
    found = default_resin(machine, layer) if machine else None
    if options["resin"] is not None:
        found = resin(options["resin"], machine, layer)
    if options["exposure"] is None:
        return found
    exposure, bottom = options["exposure"]
    if found is None:
        return moving(Resin(exposure, bottom), machine)
    return replace(found, exposure=exposure, bottom_exposure=bottom)


def refuse_what_no_print_has(output: str, kind: str, options: dict[str, Any], resin: Resin | None) -> None:
    """Raise a usage error for options that a printer's file does not allow.

    This is checked before print preparation, which may take minutes.
    """
    from fracslice.export.slices import ENDINGS, printers_file

    machine = options["machine"]
    if machine is None:
        raise click.UsageError(f'{output}: a .{kind} file needs --printer, such as sl1s; "list" shows all')
    if f".{machine.file}" in ENDINGS and (other := printers_file(machine, output)):
        raise click.UsageError(f"{output}: {other}")
    if resin is None:
        raise click.UsageError(
            f"{output}: no exposure is known for {machine.title}; expected --exposure S S or --resin"
        )
    if options["layer"][1] is not None and kind == "sl1":
        raise click.UsageError(f"{output}: an SL1 archive has layers of one height, not a range")


def created() -> datetime:
    """Date of print files, UTC: now, or of SOURCE_DATE_EPOCH."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.now(UTC)
    return datetime.fromtimestamp(int(seconds), UTC) if seconds else now


def job(scene: Scene, options: dict[str, Any]) -> SliceJob:
    """Slice job with the given options."""
    from fracslice.slicing import SliceJob

    pixel, machine = options["pixel"], options["machine"]
    if pixel is not None and machine is not None:
        raise click.UsageError("--pixel and --printer: expected one of them")
    given = (pixel, pixel) if pixel else machine.pixel if machine else (PIXEL_MM, PIXEL_MM)
    up = tuple(options.get("up") or (0.0, 0.0, 1.0))
    size = options["size"] or scene.size_mm
    return SliceJob(size, options["layer"][0], given, up, printing_of(scene, options))


def as_high_as_wanted(stack: Stack, options: dict[str, Any], work: Work) -> Stack:
    """Adaptive layers if a range of heights is given; otherwise the stack itself."""
    from fracslice.slicing import adapted

    most = options["layer"][1]
    return stack if most is None else adapted(stack, most, work)


def write_preview(stack: Stack, path: str, work: Work) -> None:
    """Write a contact sheet (.png) or an animation (.webp) of the layers."""
    from fracslice.export import replacing
    from fracslice.slicing.preview import animation, contact_sheet

    with replacing(path) as file:
        (contact_sheet if path.lower().endswith(".png") else animation)(stack, file, work)
