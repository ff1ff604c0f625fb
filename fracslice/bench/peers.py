"""External programs to compare with."""

from __future__ import annotations

import shlex
from dataclasses import dataclass

from ..errors import BenchError

PLACES = ("{workload}", "{resolution}", "{output}")


@dataclass(frozen=True)
class Peer:
    """External program to compare with.

    Attributes
    ----------
    name : str
        Name in the report.
    command : tuple of str
        Command with {workload}, {resolution} and {output}, the mesh file in scene units that it writes.
    """

    name: str
    command: tuple[str, ...]

    @classmethod
    def read(cls, text: str) -> Peer:
        """Parse NAME=COMMAND.

        Raises
        ------
        BenchError
            If the text is malformed.
        """
        name, _, command = text.partition("=")
        missing = [place for place in PLACES if place not in command]
        if not name or missing:
            raise BenchError(
                f"peer {text!r}: expected NAME=COMMAND with {{workload}}, {{resolution}} and {{output}}"
            )
        try:
            return cls(name, tuple(shlex.split(command)))
        except ValueError as error:
            raise BenchError(f"peer {text!r}: {str(error).lower()}") from None
