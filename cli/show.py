"""fracslice show: a window that shows a mesh."""

from __future__ import annotations

from .execution import is_model, load_model, load_scene, refuse_options
from .options import MeshOptions, argument, command


class ShowOptions(MeshOptions):
    """Options of `show`."""

    without = frozenset({"bodies", "heights", "paint_supports"})
    source: str = argument("MODEL|SCENE")


@command(ShowOptions)
def show(given: ShowOptions) -> None:
    """Open a window on a model file, or on the mesh of a scene, in its colours if it has some.

    All options but --threads and --quiet are for scenes.

    Examples
    --------
    fracslice show my.3mf
    fracslice show my.xml --resolution 128
    """
    from fracslice import viewer

    if is_model(given.source):
        names = {*vars(given), "formulas"} - {"source", "threads", "quiet"}
        refuse_options(names, "only for scenes, and a model was given")
        viewer.show(load_model(given.source, coloured=True))
        return
    from fracslice.jobs.mesh import make_mesh

    scene = load_scene(given.source, given.settings)
    viewer.need_screen()  # before the mesh, which may take minutes
    with given.working() as work:
        made = make_mesh(scene, given.oriented(scene, work).mesh_job(scene), work)
    viewer.show(made.shown)
