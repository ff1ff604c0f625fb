"""Bookmarks of a scene: scenes with their cameras and small pictures, kept in a folder beside its file; what
lies between two of them.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.files import replacing
from ..common.parameters import Count, Number, Vector
from ..errors import SceneError
from ..fields.registry import Node
from .document import Document

SUFFIX = ".bookmarks"
"""Ending of the folder, in place of that of the scene."""

CELLS = 24
"""Cells along each side of a box, in which the shape of a solid is judged."""

FULL = 0.02, 0.9
"""Least and greatest part of its box that a solid worth a look fills."""

ROUGH = 1.25
"""Least surface of such a solid, in surfaces of a ball of its volume."""


class Bookmarks:
    """Bookmarks in a folder, which is made with the first."""

    def __init__(self, scene: Path) -> None:
        self.folder = scene.with_suffix(SUFFIX)

    @property
    def names(self) -> list[str]:
        """Names of the bookmarks, in their order."""
        return sorted(path.stem for path in self.folder.glob("*.xml"))

    def add(self, text: str, picture: bytes) -> str:
        """Keep a scene and its picture, a JPEG; return its name."""
        number = max((int(name) for name in self.names if name.isdecimal()), default=0) + 1
        name = f"{number:03}"
        self.folder.mkdir(exist_ok=True)
        for ending, data in (".jpg", picture), (".xml", text.encode()):
            with replacing(self.folder / f"{name}{ending}") as file:
                file.write(data)
        return name

    def remove(self, name: str) -> None:
        """Remove a bookmark, and the folder with the last one."""
        path = self._known(name)
        for ending in ".xml", ".jpg":
            path.with_suffix(ending).unlink(missing_ok=True)
        with suppress(OSError):  # another file is there
            self.folder.rmdir()

    def text(self, name: str) -> str:
        """Text of a bookmark's scene."""
        try:
            return self._known(name).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise SceneError(f"{name}: {getattr(error, 'strerror', None) or error}") from None

    def picture(self, name: str) -> bytes:
        """Picture of a bookmark; nothing if it is missing."""
        with suppress(OSError):
            return self._known(name).with_suffix(".jpg").read_bytes()
        return b""

    def document(self, name: str, files_outside: bool) -> Document:
        """Scene of a bookmark."""
        # files that it names lie beside the scene, not beside the bookmark
        return Document(self.text(name), self.folder.with_suffix(".xml"), files_outside)

    def _known(self, name: str) -> Path:
        if name not in self.names:
            raise SceneError(f"{name}: expected one of the bookmarks {', '.join(self.names) or '(none)'}")
        return self.folder / f"{name}.xml"


def between(first: Node, last: Node, share: float) -> Node:
    """A solid between two of the same elements: numbers are mixed, all else is that of the nearer one.

    Raises
    ------
    SceneError
        If the elements differ, or a value between is not valid.
    """
    if first.formula is not last.formula or len(first.children) != len(last.children):
        raise SceneError("expected a bookmark of the same elements")
    children = (between(*pair, share) for pair in zip(first.children, last.children, strict=True))
    values = {
        name: _mixed(kind, first[name], last[name], share)
        for name, kind in first.formula.parameters.items()
        if first[name] != last[name]
    }
    return first.changed(tuple(children), **values)


def _mixed(kind: Any, a: Any, b: Any, share: float) -> Any:
    nearer = a if share < 0.5 else b
    plain = isinstance(a, (int, float)) and isinstance(b, (int, float))
    if isinstance(kind, Count) and plain:
        return round((1 - share) * a + share * b)
    if isinstance(kind, Number) and plain:
        return (1 - share) * a + share * b
    if isinstance(kind, Vector) and not kind.whole and np.size(a) == np.size(b):
        return tuple(((1 - share) * np.array(a) + share * np.array(b)).tolist())
    return nearer


def is_worth_a_look(root: Node) -> bool:
    """True for a solid that is neither empty nor full, and no ball."""
    box = root.bounds.box
    if not box.finite or box.empty:
        return False
    axes = [np.linspace(lo, hi, CELLS) for lo, hi in zip(box.lo, box.hi, strict=True)]
    inside = _inside(root, axes)
    if not inside.any():
        return False
    occupied = [np.flatnonzero(inside.any(tuple(i for i in range(3) if i != axis))) for axis in range(3)]
    used = inside[tuple(slice(o[0], o[-1] + 1) for o in occupied)]
    padded = np.pad(used, 1)
    faces = sum(int((padded != np.roll(padded, 1, axis)).sum()) for axis in range(3))
    volume = float(used.sum())
    # faces of the cells of a ball have 3/2 times its surface
    ball = 1.5 * (36 * np.pi * volume**2) ** (1 / 3)
    return FULL[0] < float(used.mean()) < FULL[1] and faces > ROUGH * ball


def _inside(root: Node, axes: list[NDArray[np.float64]]) -> NDArray[np.bool_]:
    x, y, z = np.meshgrid(*axes, indexing="ij")
    values = root.distance(np.stack([x, y, z], -1).reshape(-1, 3))
    return np.asarray(values < 0).reshape(x.shape)
