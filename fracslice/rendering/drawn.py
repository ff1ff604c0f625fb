"""Random numbers of a bounce."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Drawn:
    """Random numbers of a bounce.

    Attributes
    ----------
    count : int
        Numbers in use.
    """

    count: int = 0

    def names(self, count: int) -> list[str]:
        """Reserve random numbers.

        Returns
        -------
        list of str
            Their expressions.
        """
        self.count += count
        return [f"u[{k}]" for k in range(self.count - count, self.count)]
