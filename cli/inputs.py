"""What a command is pointed at: a scene file, the name of a shipped scene, or a model file."""

from __future__ import annotations

from collections.abc import Iterable
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
