"""fracslice slice: writing the layers of a print."""

from __future__ import annotations

import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .closing import of_layers
from .cluster import cluster_options, pooled
from .families import families
from .inputs import check_targets, load_scene
from .layers import LAYER, ending, heights, html_option, pixel_of, printer_option, shift, write_page
from .options import (
    NAME,
    NUMBER,
    Whole,
    length,
    output_option,
    price_option,
    print_options,
    printing_of,
    run_options,
    scale_option,
    size_option,
    source_argument,
    up_option,
)
from .working import working

if TYPE_CHECKING:
    from fracslice.export.resins import Resin
    from fracslice.scene import Scene
    from fracslice.slicing import SliceJob, Stack
    from fracslice.work import Work


@click.command("slice")
@source_argument("SCENE")
@output_option(
    "OUT",
    "A printer's file (.sl1, .goo, .ctb, .cbddlp, .pwmx, .nanodlp, ...), an .svg, .3mf, .cli or .json "
    "file, or a folder of PNG pictures.",
)
@click.option(
    "--format",
    "form",
    metavar="NAME",
    help="png, sl1, goo, ctb, cbddlp, pwmx, nanodlp, 3mf, svg, slic3r, cli, cli-binary or json; by default, "
    "that of the extension of OUT.",
)
@size_option
@up_option
@scale_option
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
    "--compensation",
    callback=shift,
    default="0",
    metavar="LENGTH",
    help="Move all outlines outwards by this, or inwards if it is negative; at most 1mm, 0 by default.",
)
@click.option("--gamma", type=NUMBER, default=1.0, metavar="N", help="Gamma of grey levels; 1 by default.")
@click.option(
    "--levels",
    type=Whole(1, 255),
    default=255,
    metavar="N",
    help="Anti-aliasing: grey levels above black, 1 for black and white; 255 by default.",
)
@click.option(
    "--blur",
    type=Whole(0, 16),
    default=0,
    metavar="N",
    help="Radius of the blur of outlines, in pixels; 0 by default.",
)
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
    callback=ending(".png", ".webp"),
    metavar="FILE",
    help="Write a contact sheet (.png) or an animation (.webp) of the layers.",
)
@html_option
@click.option(
    "--send",
    "address",
    metavar="ADDRESS",
    help="Upload the file: prusalink://HOST or sdcp://HOST. Nothing is started.",
)
@price_option("litre of resin; the resin's by default")
@cluster_options
@print_options
@run_options
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
    from fracslice.jobs.completeness import layers_amount
    from fracslice.jobs.slice_recipe import SliceRecipe
    from fracslice.scene.writer import to_xml
    from fracslice.work import Work

    kind, resin = slice_format(output, form), resin_of(options)
    if options["sections"] != "1" and kind not in PICTURES:
        raise click.UsageError(f"{output}: --sections is for pictures; contours are of one section per layer")
    if kind in PRINTS:
        refuse_what_no_print_has(output, kind, options, resin)
    if options["address"] is not None:
        refuse_to_send(output, kind, options["address"])
    preview = options["preview"]
    check_targets(source, None if Path(output).is_dir() else output, preview, options["html"])
    scene = load_scene(source, settings)
    shared = (options[name] for name in ("cluster", "shard", "store"))
    with pooled(output, threads, *shared) as pool, working(Work(threads, cluster=pool), quiet) as work:
        run = SliceRecipe(
            to_xml(scene),
            scene.name,
            job(scene, options, work),
            options["layer"][1],
            kind,
            options["machine"],
            options["compensation"],
            options["gamma"],
            options["mirror"],
            resin,
            created(),
            int(options["sections"]),
            options["levels"],
            options["blur"],
        ).run(work)
        stack, screen = run.stack, run.screen
        write_slices(run, output, form)
        if preview:
            write_preview(stack, preview, work)
        sent = uploaded(output, options["address"], work)
        if not quiet or options["html"]:
            off = layers_amount(run.slicer, work)[1]
            last = list(of_layers(run, options["price"]).lines())
        if options["html"]:
            from fracslice.jobs.slice_checks import check_run

            report = check_run(run)
            write_page(stack, report, last, output, options["html"], work)
    if not quiet:
        size = " x ".join(f"{s:.2f}" for s in stack.size)
        rows, columns = screen.shape
        click.echo(f"{output}: {len(stack.z)} layers of {columns} x {rows} pixels, {size} mm")
        other = printers_file(screen.printer, output) if screen.printer else ""
        for note in stack.notes + off + ((other,) if other else ()):
            click.echo(note)
        click.echo(os.linesep.join([*last, *([sent] if sent else [])]))
    return 0


def resin_of(options: dict[str, Any]) -> Resin | None:
    """Exposure and motion of --resin, else of the printer's own; --exposure changes them. None if there is
    neither.
    """
    from fracslice.export.resins import Resin, default_resin, moving, resin

    machine, layer = options["machine"], options["layer"][0]
    profile = default_resin(machine, layer) if machine else None
    if options["resin"] is not None:
        profile = resin(options["resin"], machine, layer)
    if options["exposure"] is None:
        return profile
    exposure, bottom = options["exposure"]
    if profile is None:
        return moving(Resin(exposure, bottom), machine)
    return replace(profile, exposure=exposure, bottom_exposure=bottom)


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


def uploaded(output: str, address: str | None, work: Work) -> str | None:
    """Upload the file to an address, if there is one; return what became of it."""
    if address is None:
        return None
    from fracslice.export.sending import send  # imports an HTTP client

    return send(output, address, work)


def refuse_to_send(output: str, kind: str, address: str) -> None:
    """Raise an error for a file that no printer reads, or an invalid address, before any work is done."""
    from fracslice.export.sending import printer_address
    from fracslice.export.slices import PRINTS

    if kind not in PRINTS:
        raise click.UsageError(f"{output}: --send is for printers' files")
    printer_address(address)


def created() -> datetime:
    """Date of print files, UTC: now, or of SOURCE_DATE_EPOCH."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.now(UTC)
    return datetime.fromtimestamp(int(seconds), UTC) if seconds else now


def job(scene: Scene, options: dict[str, Any], work: Work) -> SliceJob:
    """Slice job with the given options."""
    from fracslice.slicing import SliceJob
    from fracslice.volume.sizing import sizing

    pixel, size = pixel_of(options), sizing(scene, options["size"], options["scale"], work)
    how = printing_of(scene, options), size.factors, size.unit
    return SliceJob(size.side, options["layer"][0], pixel, options["up"], *how)


def write_preview(stack: Stack, path: str, work: Work) -> None:
    """Write a contact sheet (.png) or an animation (.webp) of the layers."""
    from fracslice.export import replacing
    from fracslice.slicing.preview import animation, contact_sheet

    with replacing(path) as file:
        (contact_sheet if path.lower().endswith(".png") else animation)(stack, file, work)
