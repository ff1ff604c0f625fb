"""Field edits: one field changed by another, its own values kept exact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from ..common.cache import key
from ..fields.box import Box
from ..fields.field import Bounds, Cells, Device, Field, Kernel, Precision
from ..fields.tree import ArrayField
from ..formulas import difference, intersection, union

Does = Literal["cut", "add", "keep"]
_FOLDED = {"cut": difference, "add": union, "keep": intersection}


@dataclass(frozen=True, eq=False)
class EditedField(ArrayField):
    """A field changed by another field."""

    root: Field  # the field to change
    does: Does  # subtract the other field's inside, add it, or intersect with it
    shape: Field  # the other field

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds of both fields together; the box encloses an added shape."""
        own, other = self.root.bounds, self.shape.bounds
        return Bounds(
            own.box | other.box if self.does == "add" else own.box,
            max(own.lipschitz, other.lipschitz),
            own.exterior_only or other.exterior_only,
            max(own.steepening, other.steepening),
            own.boxless,
            tuple(dict.fromkeys([*own.measured, *other.measured])),
        )

    @property
    def key(self) -> str:
        """`Field.key`."""
        return key(self.root.key, self.does, self.shape.key)

    @property
    def proved_box(self) -> Box:
        """`Field.proved_box`."""
        own = self.root.proved_box
        return own | self.shape.proved_box if self.does == "add" else own

    def conservative(self) -> EditedField:
        """`Field.conservative`. A cut shape stays exact: a conservative one would cut too much."""
        shape = self.shape if self.does == "cut" else self.shape.conservative()
        return EditedField(self.root.conservative(), self.does, shape)

    def cells(self, precision: Precision = "float32") -> Cells | None:
        """`Field.cells`."""
        root, shape = self.root.cells(precision), self.shape.cells(precision)
        return _CompositeCells(root, self.does, shape) if root and shape else None

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`, always on the CPU."""
        return _Composite(self.root.kernel("cpu", precision), self.does, self.shape.kernel("cpu", precision))

    def sign_kernel(self) -> Kernel:
        """`Field.sign_kernel`."""
        return _Composite(self.root.sign_kernel(), self.does, self.shape.sign_kernel())


@dataclass(frozen=True, eq=False)
class _CompositeCells:
    """`fields.field.Cells` of an edited field."""

    root: Cells
    does: Does
    shape: Cells

    def __call__(self, centres: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
        (empty, full), (no, yes) = self.root(centres, half), self.shape(centres, half)
        if self.does == "cut":
            no, yes = yes, no
        return (empty & no, full | yes) if self.does == "add" else (empty | no, full & yes)


class _Composite(Kernel):
    """Kernel of an edited field."""

    def __init__(self, root: Kernel, does: Does, shape: Kernel) -> None:
        self.dtype, self.batch = root.dtype, min(root.batch, shape.batch)
        self._root, self._does, self._shape = root, does, shape

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        f, g = self._root.points(x, y, z), self._shape.points(x, y, z)
        change = np.minimum if self._does == "add" else np.maximum
        changed: np.ndarray = change(f, -g if self._does == "cut" else g)
        return changed


def edited_field(root: Field, does: Does, shape: Field) -> Field:
    """Apply an edit to a field."""
    if root.tree and shape.tree:
        return _FOLDED[does](root.tree, shape.tree)
    return EditedField(root, does, shape)
