"""Identity of a process: two of the same make the same bytes."""

from __future__ import annotations

import platform
from dataclasses import dataclass

from ..common.keys import program
from ..version import __version__


@dataclass(frozen=True)
class Identity:
    """What two processes must share to make the same bytes.

    Attributes
    ----------
    version, python, program, processor : str
        Version of fracslice and of Python; keys of the program's text and of the processor's instructions.
    """

    version: str
    python: str
    program: str
    processor: str

    @classmethod
    def here(cls) -> Identity:
        """Identity of this process."""
        from ..kernel.host import toolchain

        return cls(__version__, platform.python_version(), program(), toolchain())

    def difference(self, expected: Identity) -> str:
        """Describe the first difference; "" if there is none.

        Parameters
        ----------
        expected : Identity
            Identity of the process that started the job.

        Returns
        -------
        str
            Such as "Python 3.12.1, expected 3.11.7".
        """
        for name, own, other in (
            ("fracslice", self.version, expected.version),
            ("Python", self.python, expected.python),
            ("program text", self.program[:8], expected.program[:8]),
            ("processor", self.processor[:8], expected.processor[:8]),
        ):
            if own != other:
                return f"{name} {own}, expected {other}"
        return ""
