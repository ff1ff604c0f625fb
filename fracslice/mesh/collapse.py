"""Vertices taken out of a closed mesh as long as it stays near them, and put back where that was too much.

Half-edge collapses under error control (Klein, Liebich and Strasser, "Mesh Reduction with Error Control",
1996): each original vertex is kept with a triangle near it, and a collapse that would leave one of them
farther off than the tolerance is not done. Neighbours are found in a corner table (Rossignac, 2001), which
remembers what was done.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fracslice._native import Reduction
from fracslice.mesh.model import Mesh
from fracslice.work import Work, chunks

STAGES = (1e-3, 0.25, 0.5, 0.75, 1.0)
"""Shares of the tolerance, in the order in which they are spent: cheap collapses first."""

FIRST = 0.3
"""About how much of all the work the first run is."""

CHUNK = 1 << 16
"""Vertices between two looks at whether to stop."""


class Collapsed(NamedTuple):
    """What the triangles of the original have become. triangles: int32 [m, 3], over its vertices. gone: bool
    [m], those that are no more. step: int32 [m], from 1, what happened to it last; 0 for one that is as it
    was. fresh: bool [m], to which something has happened since the time before. owner: int32 [n], of each
    vertex a triangle that it is near."""

    triangles: NDArray[np.int32]
    gone: NDArray[np.bool_]
    step: NDArray[np.int32]
    fresh: NDArray[np.bool_]
    owner: NDArray[np.int32]

    @property
    def changed(self) -> NDArray[np.bool_]:
        """Those that are not as they were, bool [m]."""
        return self.step > 0


class Collapse:
    """As many vertices taken out as `tolerance` (mm) allows.

    mesh: closed, an oriented 2-manifold. It stays a manifold of the same topology (the link condition of Dey,
    Edelsbrunner, Guha and Nekhayev, 1999). Every vertex is within the tolerance; the rest is likely to be,
    and triangles may cross others.
    """

    def __init__(self, mesh: Mesh, tolerance: float) -> None:
        self._mesh, self._native = mesh, Reduction(mesh.vertices, mesh.triangles, tolerance)
        self._stages: tuple[float, ...] = STAGES

    def run(self, work: Work) -> None:
        """Takes out what can go: at first, and after `undo`. Raises `Cancelled`."""
        for i, share in enumerate(self._stages):
            if len(self._stages) > 1:
                work.progress("simplifying", FIRST * i / len(self._stages))
                self._native.renew()
            while self._sweep(share, work):
                pass
        self._stages = STAGES[-1:]

    def found(self) -> Collapsed:
        """What it has come to."""
        return Collapsed(*self._native.state())

    def _sweep(self, share: float, work: Work) -> int:
        done = 0
        for part in chunks(len(self._mesh.vertices), CHUNK):
            work.check()
            done += self._native.sweep(part.start, part.stop, share)
        return done

    def undo(self, faulty: NDArray[np.bool_]) -> None:
        """Puts back what was done last at the triangles that are at fault, bool [m]; `run` does it again only
        with a quarter of the tolerance, and the next time never."""
        self._native.undo(faulty)
