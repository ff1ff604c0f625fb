"""Summaries by which the pieces of a shared surface are joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cluster import Contents, Files, packed
from ..mesh.contouring import BLUNT
from ..mesh.model import Mesh
from ..mesh.pointed_vertices import Pointed, PointedPiece
from ..mesh.survey import PieceComponents, joined_components

SEAMS = "head", "tail"
"""Fields of a `PointedPiece` with the triangles at its begin and at its end."""


@dataclass(frozen=True, eq=False)
class Summary:
    """What consecutive pieces of a surface are joined by.

    Attributes
    ----------
    ends : ndarray of float64, shape (p,)
        x at which each piece ends.
    triangles : ndarray of int64, shape (p,)
        Triangles of each piece.
    components : PieceComponents
        Connected components.
    pointed : PointedPiece
        Pointed vertices.
    blunt : ndarray of float64, shape (n, 3)
        Middles of blunt cells; if there are more than `BLUNT`, some of them.
    """

    ends: NDArray[np.float64]
    triangles: NDArray[np.int64]
    components: PieceComponents
    pointed: PointedPiece
    blunt: NDArray[np.float64]

    def packed(self) -> Contents:
        """Contents of a file."""
        seams = {
            f"{side}_{part}": getattr(getattr(self.pointed, side), part)
            for side in SEAMS
            for part in ("vertices", "triangles")
        }
        about = {
            "ends": self.ends,
            "counted": self.triangles,
            "pointed": self.pointed.points,
            "blunt": self.blunt,
        }
        return packed(**about, **seams, **vars(self.components))

    @classmethod
    def read(cls, files: Files) -> Summary:
        """Summary from its file.

        Parameters
        ----------
        files : dict
            Arrays by name.
        """
        head, tail = (Mesh(files[f"{side}_vertices"], files[f"{side}_triangles"]) for side in SEAMS)
        whole = PieceComponents(**{name: files[name] for name in PieceComponents.__dataclass_fields__})
        sharp = PointedPiece(files["pointed"], head, tail)
        return cls(files["ends"], files["counted"], whole, sharp, files["blunt"])


def joined_summary(ranges: Sequence[Summary], voxel: float, threads: int = 0) -> Summary:
    """Join the summaries of consecutive ranges of pieces.

    Parameters
    ----------
    ranges : sequence of Summary
        The ranges, in order.
    voxel : float
        Voxel, in the units of the pieces.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Summary
        Of all of them.
    """
    sharp = Pointed(voxel, threads)
    for one in ranges:
        sharp.join(one.pointed, float(one.ends[-1]))
    return Summary(
        np.concatenate([one.ends for one in ranges]),
        np.concatenate([one.triangles for one in ranges]),
        joined_components([one.components for one in ranges]),
        sharp.before(ranges[0].pointed.head),
        np.concatenate([one.blunt for one in ranges])[: BLUNT + 1],
    )
