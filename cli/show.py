"""fracslice show: a window that shows a mesh."""

from __future__ import annotations

from typing import Any

import click

from .inputs import is_model, load_model, load_scene, refuse_scene_options
from .options import job_of, job_options, print_options, run_options, source_argument
from .working import working


@click.command()
@source_argument("MODEL|SCENE")
@print_options
@job_options
@run_options
@click.pass_context
def show(
    context: click.Context,
    /,
    source: str,
    settings: tuple[str, ...],
    threads: int,
    quiet: bool,
    **options: Any,
) -> None:
    """Open a window on a model file, or on the mesh of a scene.

    All options but --threads and --quiet are for scenes.
    """
    from fracslice import viewer

    if is_model(source):
        refuse_scene_options(context)
        viewer.show(load_model(source))
        return
    from fracslice.jobs.mesh import make_mesh

    scene = load_scene(source, settings)
    viewer.need_screen()  # before the mesh, which may take minutes
    with working(threads, quiet) as work:
        mesh = make_mesh(scene, job_of(scene, **options), work).mesh
    viewer.show(mesh)
