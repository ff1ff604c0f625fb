"""fracslice explore: a contact sheet of variations of a scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .inputs import check_folder, check_targets, load_scene
from .options import Whole, output_option, run_options, source_argument
from .sizes import pixels
from .working import working

if TYPE_CHECKING:
    import numpy as np

    from fracslice.scene import Scene
    from fracslice.work import Work


@click.command(short_help="Show variations of SCENE on a contact sheet.")
@source_argument("SCENE")
@output_option("FILE.png", "The contact sheet.")
@click.option("--count", type=Whole(1, 400), default=16, show_default=True, metavar="N", help="Pictures.")
@click.option(
    "--seed",
    type=Whole(0, 2**31),
    default=0,
    show_default=True,
    metavar="N",
    help="Of the changes.",
)
@click.option(
    "--spread",
    type=click.FloatRange(0, 4, min_open=True),
    default=0.3,
    show_default=True,
    metavar="X",
    help="Size of the changes: 1 doubles or halves a number in a typical case.",
)
@click.option("--from", "parent", metavar="FILE.xml", help="Vary this scene of an earlier sheet instead.")
@click.option(
    "--size", callback=pixels, default="240x180", show_default=True, metavar="WxH", help="Of a picture."
)
@click.option("--samples", type=Whole(1, 1000), default=8, show_default=True, metavar="N", help="Per pixel.")
@run_options
def explore(
    source: str,
    output: str,
    count: int,
    seed: int,
    spread: float,
    parent: str | None,
    size: tuple[int, int],
    samples: int,
    settings: tuple[str, ...],
    threads: int,
    quiet: bool,
) -> None:
    """Show variations of SCENE on a contact sheet, and write the scene of each beside it.

    The first picture is SCENE itself. In the others the numbers of its elements are changed at random within
    their ranges; materials, transforms, boxes and the view stay. Picture 7 of sheet.png is sheet/07.xml,
    which --from takes. Nothing is written before all pictures are done.
    """
    from fracslice.scene.variation import varied

    target = Path(output)
    if target.suffix.lower() != ".png":
        raise click.UsageError(f"{output}: expected a .png file")
    check_targets(source, output)
    check_folder(target.with_suffix(""))
    scene = load_scene(parent or source, settings)
    scenes = [scene, *(varied(scene, (seed, k), spread) for k in range(1, count))]
    with working(threads, quiet) as work:
        pictures = [rendered(one, size, samples, k / count, work) for k, one in enumerate(scenes)]
    write(target, scenes, pictures)
    if not quiet:
        click.echo(f"{output}: {count} variations; their scenes are in {target.with_suffix('')}")


def rendered(scene: Scene, size: tuple[int, int], samples: int, before: float, work: Work) -> np.ndarray:
    """Render one picture; `before` is the share of the sheet that is done."""
    from fracslice.rendering import Renderer

    renderer = Renderer(scene.root, scene.view, size, replace(work, progress=lambda *_: None))
    for _ in renderer.passes(samples):
        work.progress("rendering", before)
    return renderer.seen().shown


def write(target: Path, scenes: Sequence[Scene], pictures: Sequence[np.ndarray]) -> None:
    """Write the contact sheet and the folder of its scenes."""
    from PIL import Image, ImageDraw

    from fracslice.export import replacing
    from fracslice.scene.writer import to_xml

    height, width = pictures[0].shape[:2]
    across = math.ceil(math.sqrt(len(pictures)))
    sheet = Image.new("RGB", (across * width, -(-len(pictures) // across) * height))
    draw, folder = ImageDraw.Draw(sheet), target.with_suffix("")
    folder.mkdir(exist_ok=True)
    for k, (scene, picture) in enumerate(zip(scenes, pictures, strict=True)):
        corner = k % across * width, k // across * height
        sheet.paste(Image.fromarray(picture), corner)
        draw.text(
            (corner[0] + 4, corner[1] + 2), f"{k:02}", fill="white", stroke_fill="black", stroke_width=1
        )
        with replacing(folder / f"{k:02}.xml") as file:
            file.write(to_xml(scene).encode())
    with replacing(target) as file:
        sheet.save(file, "PNG")
