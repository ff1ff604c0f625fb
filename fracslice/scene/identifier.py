"""Names of a scene's own formulas and parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..formulas.parameters import Parameter
from ..formulas.white_list import is_name


@dataclass(frozen=True)
class Identifier(Parameter):
    """A name of lower-case letters, digits and underscores that begins with a letter."""

    @property
    def expects(self) -> str:
        return "a name of at most 40 lower-case letters, digits and _, not one of a function"

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or not is_name(value):
            raise ValueError(self.expects)
        return value
