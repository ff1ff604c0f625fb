"""What a command reads, a scene file, the name of a shipped scene or a model file, and where it writes."""

from __future__ import annotations

import os
from collections.abc import Container, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fracslice.errors import MeshError

if TYPE_CHECKING:
    from fracslice.mesh import Mesh
    from fracslice.scene import Scene


class BadInput(click.ClickException):
    """What the command was pointed at cannot be used."""

    exit_code = 2


def scene_path(source: str) -> Path:
    """A scene file, or that of the shipped scene of that name if there is no such file."""
    from fracslice.scene import library

    if is_model(source) and Path(source).is_file():
        raise BadInput(f"{source}: expected a scene, found a model; only check and show take models")
    bare = Path(source).name == source and not Path(source).suffix
    return Path(source) if Path(source).exists() or not bare else library.path(source)


def load_scene(source: str, settings: Iterable[str] = ()) -> Scene:
    """The scene that the command is pointed at; --set applied."""
    from fracslice.scene import read

    return read(scene_path(source)).with_values(settings)


def is_model(source: str) -> bool:
    """Whether the file's name is that of a model."""
    from fracslice.mesh.reading import READERS

    return Path(source).suffix.lower() in READERS


def load_model(source: str) -> Mesh:
    """The mesh in a model file; one that cannot be read is bad input."""
    from fracslice.mesh.reading import read_mesh

    try:
        return read_mesh(source)
    except MeshError as error:
        raise BadInput(str(error)) from error


def refuse_options(context: click.Context, names: Container[str], why: str) -> None:
    """Raises for an option that was given, though it would say nothing."""
    for option in context.command.params:
        name = str(option.name)
        given = context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE
        if given and name in names:
            raise click.UsageError(f"{option.opts[-1]}: {why}")


def refuse_scene_options(context: click.Context) -> None:
    """Options that would say something about a scene say nothing about a model."""
    names = {str(option.name) for option in context.command.params}
    of_both = {"source", "as_json", "threads", "quiet"}
    refuse_options(context, names - of_both, "only for scenes, and a model was given")


def check_targets(source: str, *targets: str | None) -> None:
    """Refuses files that could not be written, or would replace the scene or each other, before any work is
    done.
    """
    from fracslice.export import check_target

    taken = {os.path.realpath(source)}
    for target in targets:
        if target is None:
            continue
        if os.path.realpath(target) in taken:
            raise click.UsageError(f"{target}: expected another file; this one is named twice")
        taken.add(os.path.realpath(target))
        check_target(target)


def check_folder(folder: Path) -> None:
    """Refuses a folder that could not be made or written to before any work is done."""
    from fracslice.export import check_target

    if folder.exists() and not folder.is_dir():
        raise click.UsageError(f"{folder}: expected a folder")
    check_target(folder / "a file" if folder.is_dir() else folder)
