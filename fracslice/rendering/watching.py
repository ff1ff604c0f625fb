"""Changes of a file on disk."""

from __future__ import annotations

import time
from pathlib import Path

POLL = 0.2
"""Interval between checks of the file, seconds."""


class WatchedFile:
    """File that another program may save again.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._checked, self._saved = time.monotonic(), self._stamp()

    def changed(self) -> bool:
        """Return whether the file was saved since the last call; the disk is asked at most every `POLL`."""
        now, saved = time.monotonic(), self._saved
        if now - self._checked < POLL:
            return False
        self._checked, self._saved = now, self._stamp() or saved
        return self._saved != saved

    def _stamp(self) -> tuple[int, int] | None:
        """Modification time and size of the file; None while it is being replaced."""
        try:
            status = self._path.stat()
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size
