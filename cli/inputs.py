"""Inputs and outputs of commands: scene files, names of shipped scenes, model files and output paths."""

from __future__ import annotations

import os
from collections.abc import Container, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fracslice.errors import MeshError, SceneError
from fracslice.formats import ENDINGS, SOLIDS

from .execution import stopped_at_once

if TYPE_CHECKING:
    from fracslice.mesh import Mesh
    from fracslice.scene import Scene


class BadInput(click.ClickException):
    """The input of a command cannot be used."""

    exit_code = 2


def scene_path(source: str) -> Path:
    """Path of a scene file, or of the shipped scene of that name if there is no such file.

    Raises `BadInput` for a model file.
    """
    from fracslice.scene import library

    if is_model(source) and Path(source).is_file():
        raise BadInput(f"{source}: expected a scene, found a model")
    bare = Path(source).name == source and not Path(source).suffix
    return Path(source) if Path(source).exists() or not bare else library.path(source)


def load_scene(source: str, settings: Iterable[str] = ()) -> Scene:
    """Read the scene of a command, or that of a model file, and apply the values of --set."""
    with stopped_at_once():
        return _scene(source).with_values(settings)


def _scene(source: str) -> Scene:
    """Scene of a file or a name; of a model or a grid the scene of that alone, in mm."""
    from fracslice.scene import read

    if formula := SOLIDS.get(Path(source).suffix.lower()):
        from fracslice.formulas import get
        from fracslice.scene import scene

        try:
            solid = get(formula)(source, place="as is", units="mm")
            return scene(solid, unit=1.0, name=Path(source).stem)
        except SceneError as error:
            raise BadInput(f"{source}: {error.__cause__ or error}") from error
    outside = click.get_current_context().params.get("allow_files_outside", False)
    return read(scene_path(source), files_outside=outside)


def refuse_moved(scene: Scene, settings: Iterable[str]) -> None:
    """Raise `BadInput` for a setting of an attribute that a track moves: it would have no effect."""
    moved = {"".join(track.of.split()) for track in scene.tracks}
    for setting in settings:
        if "".join(setting.partition("=")[0].split()) in moved:
            raise BadInput(f"{setting}: a <track> moves it; expected another attribute, or other keys")


def is_model(source: str) -> bool:
    """True if the file name has the extension of a model."""
    return Path(source).suffix.lower() in ENDINGS


def load_model(source: str) -> Mesh:
    """Read the mesh of a model file. Raises `BadInput` if it cannot be read."""
    from fracslice.mesh.models import read_mesh

    try:
        with stopped_at_once():
            return read_mesh(source)
    except MeshError as error:
        raise BadInput(str(error)) from error


def refuse_options(names: Container[str], why: str) -> None:
    """Raise a usage error for a given option that has no effect here."""
    context = click.get_current_context()
    for option in context.command.params:
        name = str(option.name)
        given = context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE
        if given and name in names:
            raise click.UsageError(f"{option.opts[-1]}: {why}")


def check_targets(source: str, *targets: str | None) -> None:
    """Check output files before any work is done.

    Raises an error for a file that cannot be written, or that would replace the scene or another output.
    """
    from fracslice.common.files import check_target

    taken = {os.path.realpath(source)}
    for target in targets:
        if target is None:
            continue
        if os.path.realpath(target) in taken:
            raise click.UsageError(f"{target}: expected another file; this one is named twice")
        taken.add(os.path.realpath(target))
        check_target(target)


def check_folder(folder: Path) -> None:
    """Check before any work is done that a folder can be made or written to."""
    from fracslice.common.files import check_target

    if folder.exists() and not folder.is_dir():
        raise click.UsageError(f"{folder}: expected a folder")
    check_target(folder / "a file" if folder.is_dir() else folder)
