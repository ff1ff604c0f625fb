"""Files of a shared mesh job: arrays, and the pieces of its surface."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cluster import ResultFolder
from .mesh.model import Mesh
from .mesh.pieces import Pieces as MeshPieces
from .store import Arrays

Files = dict[str, NDArray[Any]]
"""Arrays by name."""


def packed(**arrays: NDArray[Any]) -> bytes:
    """Bytes of arrays.

    Parameters
    ----------
    **arrays : ndarray
        Arrays by name.

    Returns
    -------
    bytes
        For `unpacked`.
    """
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]  # names are no options of savez
    return file.getvalue()


def unpacked(data: bytes) -> Files:
    """Arrays from bytes of `packed`.

    Parameters
    ----------
    data : bytes
        The bytes.

    Returns
    -------
    dict
        Arrays by name.
    """
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return dict(arrays)


class StoredPieces(MeshPieces):
    """Pieces of a surface as files of a job.

    Parameters
    ----------
    store : Pieces
        Files.
    job : str
        Key of the job.
    prefix : str, optional
        Begin of their names.
    """

    def __init__(self, store: ResultFolder, job: str, prefix: str = "") -> None:
        super().__init__()
        self.store, self.job, self.prefix = store, job, prefix
        self.first_labels = list[int]()

    def anew(self) -> StoredPieces:
        """Return an empty collection with other names; see `Pieces.anew`."""
        return StoredPieces(self.store, self.job, "tipped-")

    def labels(self, number: int) -> NDArray[np.int32]:
        """Load the labels of a piece, which its file counts from 0; see `Pieces.labels`."""
        return super().labels(number) + np.int32(self.first_labels[number] if self.first_labels else 0)

    def put(self, number: int, mesh: Mesh) -> None:
        """Store a piece that another process counts.

        Parameters
        ----------
        number : int
            Index of the piece.
        mesh : Mesh
            The piece.
        """
        self._put(f"mesh{number}", vertices=mesh.vertices, triangles=mesh.triangles)

    def _put(self, name: str, **arrays: NDArray[Any]) -> None:
        self.store.write(self.job, self.prefix + name, packed(**arrays))

    def _get(self, name: str) -> Arrays:
        return unpacked(self.store.read(self.job, self.prefix + name))
