"""The scenes that ship with fracslice."""

from __future__ import annotations

import re
from pathlib import Path

from ..errors import SceneError
from ..nearest import hint

_COMMENT = re.compile(r"<!--\s*(.*?)\s*-->", re.DOTALL)


def folder() -> Path:
    """Where the shipped scenes are: in the installed package, or beside it in a checkout."""
    package = Path(__file__).parents[1]
    installed = package / "scenes"
    return installed if installed.is_dir() else package.parent / "scenes"


def names() -> list[str]:
    """The names of the shipped scenes, sorted."""
    return sorted(path.stem for path in folder().glob("*.xml"))


def path(name: str) -> Path:
    """The file of the shipped scene `name`. Raises `SceneError` with the nearest right name."""
    if name not in names():
        raise SceneError(f"{name}: no such scene; {hint(name, names())}")
    return folder() / f"{name}.xml"


def about(name: str) -> str:
    """What the shipped scene is: its first comment, as one line. Raises `SceneError`."""
    comment = _COMMENT.search(path(name).read_text(encoding="utf-8"))
    return " ".join(comment[1].split()) if comment else ""
