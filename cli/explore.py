"""fracslice explore: a contact sheet of variations of a scene."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .execution import check_folder, check_targets, load_scene
from .options import PIXELS, Parsed, SceneOptions, Whole, argument, command, option, output

if TYPE_CHECKING:
    import numpy as np

    from fracslice.scene import Scene
    from fracslice.work import Work


def read_spread(text: str) -> float:
    """Parse the size of changes."""
    from fracslice.common.parameters import Number

    return float(Number(0.3, "", above=0, most=4).read(text))


class ExploreOptions(SceneOptions):
    """Options of `explore`."""

    source: str = argument("SCENE")
    output: str = output("FILE.png", "The contact sheet.", ".png")
    count: int = option(Whole(1, 400), "Number of pictures; 16 by default.", default=16)
    seed: int = option(Whole(0, 2**31), "Seed of the changes; 0 by default.", default=0)
    spread: float = option(
        Parsed(read_spread, "X"),
        "Size of the changes: 1 doubles or halves a number in a typical case; 0.3 by default.",
        default="0.3",
    )
    size: tuple[int, int] = option(
        PIXELS, "Pixels of each picture, across and down; 240x180 by default.", default="240x180"
    )
    samples: int = option(Whole(1, 1000), "Samples per pixel; 8 by default.", default=8)


@command(ExploreOptions, short_help="Show variations of SCENE on a contact sheet.")
def explore(given: ExploreOptions) -> None:
    """Show variations of SCENE on a contact sheet, and write the scene of each beside it.

    The first picture is SCENE itself. In the others the numbers of its elements are changed at random within
    their ranges; materials, transforms, boxes and the view stay. Picture 7 of sheet.png is sheet/07.xml,
    which is a SCENE to go on from. Nothing is written before all pictures are done; the scenes of an earlier
    sheet of the same name are then replaced.

    Examples
    --------
    fracslice explore quaternion-julia -o sheet.png --spread 0.5
    fracslice explore sheet/07.xml -o next.png --seed 1
    """
    from fracslice.scene.layout import varied

    target, count = Path(given.output), given.count
    check_targets(given.source, given.output)
    check_folder(target.with_suffix(""))
    if Path(given.source).resolve().parent == target.with_suffix("").resolve():
        raise click.UsageError(f"{given.output}: its scenes replace {given.source}: expected another name")
    scene = load_scene(given.source, given.settings)
    scenes = [scene, *(varied(scene, (given.seed, k), given.spread) for k in range(1, count))]
    with given.working() as work:
        pictures = [
            render_tile(one, given.size, given.samples, k / count, work) for k, one in enumerate(scenes)
        ]
        write(target, scenes, pictures)
    if not given.quiet:
        click.echo(f"{given.output}: {count} variations; their scenes are in {target.with_suffix('')}")


def render_tile(scene: Scene, size: tuple[int, int], samples: int, before: float, work: Work) -> np.ndarray:
    """Render one picture; `before` is the share of the sheet that is done."""
    from fracslice.rendering import Renderer

    renderer = Renderer(scene.root, scene.view, size, replace(work, progress=lambda *_: None))
    for _ in renderer.passes(samples):
        work.progress("rendering", before)
    return renderer.seen().shown


def write(target: Path, scenes: Sequence[Scene], pictures: Sequence[np.ndarray]) -> None:
    """Write the contact sheet and the folder of its scenes."""
    from PIL import Image, ImageDraw

    from fracslice.common.files import replacing
    from fracslice.scene.model import to_xml

    height, width = pictures[0].shape[:2]
    across = math.ceil(math.sqrt(len(pictures)))
    sheet = Image.new("RGB", (across * width, -(-len(pictures) // across) * height))
    draw, folder = ImageDraw.Draw(sheet), target.with_suffix("")
    folder.mkdir(exist_ok=True)
    if target.exists():
        remove_scenes(folder, len(scenes))
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


def remove_scenes(folder: Path, first: int) -> None:
    """Remove the scenes of an earlier, larger sheet, from a number on."""
    for k in itertools.count(first):
        path = folder / f"{k:02}.xml"
        if not path.is_file():
            return
        path.unlink()
