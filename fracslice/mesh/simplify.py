"""Mesh simplification within a proved tolerance or to a count, by half-edge collapses that are verified.

Klein, Liebich and Strasser, "Mesh Reduction with Error Control", 1996: each original vertex is assigned to a
triangle near it, and a collapse is refused if it would leave one of them farther off than the tolerance.
Adjacency is a corner table (Rossignac, 2001) with a history.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import Reduction, connected_components
from ..common.parameters import AnyLength, Count, Number, parse_length, validate_value
from ..errors import MeshError
from ..work import Work, chunks
from .model import Mesh, Nearest, build, component_sizes, edge_topology, self_intersecting_triangles

ROUNDS, PATIENT = 200, 40
"""Maximum rounds of verification and undo, and number of the first rounds in which new collapses may replace
the undone ones.
"""

AIM = 0.95
"""Fraction of the tolerance for vertices; the triangles between them need the rest."""


@dataclass(frozen=True)
class Simplified:
    """Result of a simplification."""

    tolerance_mm: float  # tolerance
    from_triangles: int  # triangles of the original mesh
    # proved bound on the distance of all points of the original surface from the simplified one; at most the
    # tolerance
    bound_mm: float
    # greatest distance of the samples of the simplified surface from the original one; at most the tolerance
    back_mm: float


def simplify(mesh: Mesh, tolerance: AnyLength, work: Work | None = None) -> tuple[Mesh, Simplified]:
    """Simplify a mesh within a tolerance.

    The vertices of the result are vertices of the original, and so stay on the surface and on sharp edges.
    The result is verified: a bound on the distance of every original triangle, the distance back at samples
    half an edge apart, self-intersections, and the orientation of the shells. Collapses that fail are undone.

    `mesh` in mm; `tolerance`: maximum distance between both surfaces: mm, for example "0.02mm".
    """
    work = work or Work()
    length = parse_length(tolerance, "tolerance") if isinstance(tolerance, str) else tolerance
    length = validate_value("tolerance", length, Number(None, "a length", above=0), MeshError)
    _require_manifold(mesh)
    collapse = Collapse(mesh, AIM * length)
    done = _verified(mesh, collapse, length, work, partial(collapse.run, work))
    if done is None:
        raise MeshError(f"the mesh cannot be simplified within {length:g} mm without crossing itself")
    return done


def simplify_to(mesh: Mesh, count: int | None, work: Work | None = None) -> tuple[Mesh, Simplified]:
    """Simplify a mesh to at most a number of triangles, verified as by `simplify`.

    The tolerance grows by steps of a quarter, and stays at the first one that leaves no more triangles.

    `mesh` in mm; `count`: most triangles of the result.
    """
    work = work or Work()
    count = validate_value("faces", count, Count(None, "", FEWEST, 1 << 31), MeshError)
    _require_manifold(mesh)
    if len(mesh.triangles) <= count:
        return mesh, Simplified(0.0, len(mesh.triangles), 0.0, 0.0)
    longest = COARSEST * float(mesh.size.max())
    collapse = Collapse(mesh, AIM * longest)
    for step in range(STEPS + 1):
        share = GROWTH ** (step - STEPS)
        work.progress("simplifying", step / STEPS)
        if (left := collapse.reach(count, share, work)) > count:
            continue
        done = _verified(mesh, collapse, share * longest, work, partial(collapse.reach, count, share, work))
        if done is not None and len(done[0].triangles) <= count:
            return done
    fewest = f"; {left:,} are left" if left > count else ""
    raise MeshError(f"the mesh cannot be simplified to {count:,} triangles without crossing itself{fewest}")


FEWEST = 4
"""Triangles of the smallest closed mesh."""
COARSEST, GROWTH, STEPS = 0.25, 1.25, 50
"""Last tolerance that is tried for a count, longest sides; factor from one to the next; their number."""


def _require_manifold(mesh: Mesh) -> None:
    _, *defects = edge_topology(mesh.triangles, len(mesh.vertices))
    if any(defects) or not len(mesh.triangles):
        raise MeshError("only a closed, oriented manifold can be simplified")


def _verified(
    mesh: Mesh, collapse: Collapse, tolerance: float, work: Work, again: Callable[[], object]
) -> tuple[Mesh, Simplified] | None:
    """Simplified mesh without faults; None if faults remain. `again` collapses what has come back."""
    examination = Examination(mesh, tolerance, work)
    for number in range(ROUNDS):
        if number < PATIENT:
            again()
        work.progress("simplifying", 1 - (1 - FIRST) * 0.6**number)
        result = collapse.state()
        faulty = examination.faults(result)
        if not faulty.any():
            done = Simplified(tolerance, len(mesh.triangles), *examination.distances(result))
            return Mesh(mesh.vertices, result.triangles).selected(~result.gone), done
        collapse.undo(faulty)
    return None


STAGES = (1e-3, 0.25, 0.5, 0.75, 1.0)
"""Fractions of the tolerance, in the order in which they are spent: cheap collapses first."""

FIRST = 0.3
"""Approximate fraction of all the work that the first run takes."""

CHUNK = 1 << 16
"""Vertices between two checks for cancellation."""


class Collapsed(NamedTuple):
    """State of a simplification, over the triangles and vertices of the original mesh."""

    triangles: NDArray[np.int32]  # current corners of each triangle
    gone: NDArray[np.bool_]  # true for each removed triangle
    # number, from 1, of the last collapse that changed each triangle; 0 for an unchanged one
    step: NDArray[np.int32]
    fresh: NDArray[np.bool_]  # true for each triangle that changed since the previous state
    owner: NDArray[np.int32]  # A triangle near each vertex

    @property
    def changed(self) -> NDArray[np.bool_]:
        """True for each changed triangle, bool [m]."""
        return self.step > 0


class Collapse:
    """Simplify a mesh by half-edge collapses within a tolerance.

    The topology of the manifold is preserved (the link condition of Dey, Edelsbrunner, Guha and Nekhayev,
    1999). Every original vertex stays within the tolerance; the points between them probably do, and
    triangles may intersect.

    `mesh`, `tolerance` in mm.
    """

    def __init__(self, mesh: Mesh, tolerance: float) -> None:
        self._mesh, self._native = mesh, Reduction(mesh.vertices, mesh.triangles, tolerance)
        self._stages: tuple[float, ...] = STAGES
        self._fresh = np.zeros(len(mesh.triangles), bool)

    def run(self, work: Work) -> None:
        """Collapse all edges that the tolerance allows, at first and after each `undo`."""
        for i, share in enumerate(self._stages):
            if len(self._stages) > 1:
                work.progress("simplifying", FIRST * i / len(self._stages))
                self._native.renew()
            while self._sweep(share, work):
                pass
        self._stages = STAGES[-1:]

    def reach(self, count: int, share: float, work: Work) -> int:
        """Collapse edges that a share of the tolerance allows until a number of triangles is left, at most.

        Returns the number that is left.
        """
        self._native.renew()
        state = self.state()
        self._fresh, left, before = state.fresh, int((~state.gone).sum()), -1
        while count < left != before:
            before, first = left, 0
            while left > count and first < len(self._mesh.vertices):
                work.check()
                last = min(first + min(CHUNK, (left - count + 1) // 2), len(self._mesh.vertices))
                left -= 2 * self._native.sweep(first, last, share)  # a vertex and two triangles at most
                first = last
        return left

    def state(self) -> Collapsed:
        """Current state."""
        state, fresh = Collapsed(*self._native.state()), self._fresh
        self._fresh = np.zeros_like(fresh)
        return state._replace(fresh=state.fresh | fresh)

    def _sweep(self, share: float, work: Work) -> int:
        """Sweep over all vertices at a fraction of the tolerance; returns the number of collapses."""
        done = 0
        for part in chunks(len(self._mesh.vertices), CHUNK):
            work.check()
            done += self._native.sweep(part.start, part.stop, share)
        return done

    def undo(self, faulty: NDArray[np.bool_]) -> None:
        """Undo the last collapse at each faulty triangle.

        `run` repeats such a collapse only within a quarter of the tolerance, and never after a second undo.

        `faulty`: bool (m,).
        """
        self._native.undo(faulty)


class Examination:
    """Verify a simplification of a mesh within a tolerance.

    Results are stored per triangle of the original mesh and stay valid until something they depend on
    changes.

    `tolerance` in mm; `bound`: float64 (m,); `beyond`: int32 (k, 2); `back`: float64 (m,); `crossing`: bool
    (m,).
    """

    def __init__(self, mesh: Mesh, tolerance: float, work: Work) -> None:
        self.mesh, self.tolerance, self.work = mesh, tolerance, work
        self.spacing, self.shells = _edge(mesh) / 2, _Shells(mesh)
        work.check()
        tree = build(mesh)
        work.check()
        self.original = Nearest(mesh, tree, closed=True)
        self.bound, self.back = np.zeros(len(mesh.triangles)), np.zeros(len(mesh.triangles))
        self.crossing, self.beyond = np.zeros(len(mesh.triangles), dtype=bool), np.empty((0, 2), np.int32)

    def faults(self, collapsed: Collapsed) -> NDArray[np.bool_]:
        """Triangles whose last collapse has to be undone.

        Returns bool (m,).
        """
        left = _Left(self.mesh, collapsed)
        faulty = self._there(left, collapsed) | self._back(collapsed)
        self.work.check()
        self.crossing = left.crossing(collapsed.fresh | self.crossing, self.work)
        faulty |= (self.crossing | left.all(self.shells.turned(left.mesh))) & collapsed.changed
        return faulty

    def distances(self, collapsed: Collapsed) -> tuple[float, float]:
        """Greatest distances between the two surfaces.

        Returns a proved bound from the original to the simplified one, and the greatest sampled
        distance back, mm.
        """
        there, back = self.bound[collapsed.changed], self.back[collapsed.changed & ~collapsed.gone]
        return float(there.max(initial=0.0)), float(back.max(initial=0.0))

    def _there(self, left: _Left, collapsed: Collapsed) -> NDArray[np.bool_]:
        """Faulty triangles by the distance from the original: of the triangles near one that is too far off,
        the one that changed last.
        """
        lost = collapsed.fresh | collapsed.fresh[collapsed.owner][self.mesh.triangles].any(axis=1)
        lost[self.beyond[collapsed.fresh[self.beyond[:, 1]], 0]] = True
        which = np.flatnonzero(lost & collapsed.changed)
        these = Mesh(self.mesh.vertices, self.mesh.triangles[which])
        hints = left.number[collapsed.owner[these.triangles]]
        self.bound[which], pairs = left.nearest.bounds(these, self.tolerance, self.work, hints)
        beyond = np.column_stack([which[pairs[:, 0]], left.old[pairs[:, 1]]]).astype(np.int32)
        self.beyond = np.concatenate([self.beyond[~lost[self.beyond[:, 0]]], beyond])
        far = np.flatnonzero(np.isinf(self.bound) & collapsed.changed)
        suspects = np.column_stack([collapsed.owner[self.mesh.triangles[far]], far])
        latest = collapsed.step[suspects].argmax(axis=1)
        faulty = np.zeros(len(lost), dtype=bool)
        faulty[suspects[np.arange(len(suspects)), latest]] = True
        return faulty

    def _back(self, collapsed: Collapsed) -> NDArray[np.bool_]:
        """Changed triangles with samples too far from the original."""
        new = collapsed.changed & ~collapsed.gone
        fresh = new & collapsed.fresh
        these = Mesh(self.mesh.vertices, collapsed.triangles[fresh])
        self.back[fresh] = self.original.samples(these, self.spacing, self.work, self.tolerance)
        return new & (self.back > self.tolerance)


class _Left:
    """The remaining triangles as a mesh. `number`, int32 [m], has their indices in it."""

    def __init__(self, mesh: Mesh, collapsed: Collapsed) -> None:
        self.old = np.flatnonzero(~collapsed.gone)
        self.number = np.cumsum(~collapsed.gone, dtype=np.int32) - np.int32(1)
        self.mesh = Mesh(mesh.vertices, collapsed.triangles[self.old])
        self.tree = build(self.mesh)
        self.nearest = Nearest(self.mesh, self.tree)

    def crossing(self, among: NDArray[np.bool_], work: Work) -> NDArray[np.bool_]:
        """Triangles that intersect another one; one triangle of each pair is in `among`. Bool [m], over the
        original triangles.
        """
        return self.all(self_intersecting_triangles(self.mesh, self.tree, work.threads, among[self.old]))

    def all(self, marks: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Marks of the remaining triangles as marks of the original ones."""
        result = np.zeros(len(self.number), dtype=bool)
        result[self.old] = marks
        return result


class _Shells:
    """Shells of the original mesh, to compare with the simplified one."""

    def __init__(self, mesh: Mesh) -> None:
        self.of, self.count = connected_components(mesh.triangles, len(mesh.vertices))
        self.outside = self._volumes(mesh) >= 0

    def turned(self, mesh: Mesh) -> NDArray[np.bool_]:
        """Triangles of shells that are inside out or flat: crumbs that fewer triangles cannot represent."""
        volumes = self._volumes(mesh)
        result: NDArray[np.bool_] = np.where(self.outside, volumes <= 0, volumes >= 0)[
            self.of[mesh.triangles[:, 0]]
        ]
        return result

    def _volumes(self, mesh: Mesh) -> NDArray[np.float64]:
        """Signed volumes of the shells."""
        return component_sizes(mesh.vertices, mesh.triangles, self.of, self.count).volumes


def _edge(mesh: Mesh) -> float:
    """Median edge length."""
    a, b = mesh.vertices[mesh.triangles[:, 0]], mesh.vertices[mesh.triangles[:, 1]]
    return float(np.median(np.linalg.norm(a - b, axis=1)))
