"""Scenes that ship with fracslice."""

from __future__ import annotations

import re
from pathlib import Path

from ..common.messages import hint
from ..errors import SceneError

_COMMENT = re.compile(r"<!--\s*(.*?)\s*-->", re.DOTALL)


def folder() -> Path:
    """Return the folder of the shipped scenes: in the installed package, or beside it in a checkout."""
    package = Path(__file__).parents[1]
    installed = package / "scenes"
    return installed if installed.is_dir() else package.parent / "scenes"


def names() -> list[str]:
    """Return the names of the shipped scenes.

    Returns
    -------
    list of str
        Sorted names.
    """
    return sorted(path.stem for path in folder().glob("*.xml"))


def gallery() -> list[str]:
    """Return the names of the scenes of the gallery.

    Returns
    -------
    list of str
        Sorted names.
    """
    return sorted(path.stem for path in folder().glob("gallery/*.xml"))


def path(name: str) -> Path:
    """Return the file of a shipped scene, or of one of the gallery."""
    if name in names():
        return folder() / f"{name}.xml"
    if name in gallery():
        return folder() / "gallery" / f"{name}.xml"
    raise SceneError(f"{name}: no such scene; {hint(name, {*names(), *gallery()})}")


def file_of(source: str) -> Path:
    """Return the file that a source names: one on disk, or a scene that ships if it is a bare name."""
    file = Path(source)
    bare = file.name == source and not file.suffix
    return file if file.exists() or not bare else path(source)


def about(name: str) -> str:
    """Return the description of a shipped scene: its first comment, on one line."""
    comment = _COMMENT.search(path(name).read_text(encoding="utf-8"))
    return " ".join(comment[1].split()) if comment else ""
