"""Records behind the elements of a scene file, and their names.

Every field carries a parameter kind that reads, validates, writes and documents it, as in formulas.
"""

from __future__ import annotations

from dataclasses import Field, dataclass, field
from inspect import cleandoc
from typing import Any, ClassVar

from ..errors import SceneError
from ..formulas.definitions import is_name
from ..formulas.node import parameter_lines
from ..formulas.parameters import Parameter, kinds_of, validate


@dataclass(frozen=True, kw_only=True)
class Part:
    """Base of the records of a scene file.

    Attributes
    ----------
    element : str
        Element name.
    many : bool
        True if the element may be repeated.
    description : str
        Docstring without the attributes, which are added to it.
    place : str or None
        Position in the file, "file:line".

    Raises
    ------
    SceneError
        If a value is invalid.
    """

    element: ClassVar[str]
    many: ClassVar[bool] = False
    description: ClassVar[str]
    place: str | None = field(default=None, compare=False, repr=False)

    def __init_subclass__(cls) -> None:
        cls.description = cleandoc(cls.__doc__ or "")
        kinds = {
            name: given.metadata["kind"] for name, given in vars(cls).items() if isinstance(given, Field)
        }
        lines = [cls.description, "", "Attributes", "----------", *parameter_lines(kinds)]
        cls.__doc__ = "\n".join(lines)

    def __post_init__(self) -> None:
        validate(self, self.fail)
        self.validate()

    def validate(self) -> None:
        """Raise `SceneError` for values that are invalid in combination."""

    @classmethod
    def kinds(cls) -> dict[str, Any]:
        """Return the parameter kinds.

        Returns
        -------
        dict of str to Parameter
            Kinds by field name.
        """
        return kinds_of(cls)

    def fail(self, message: str) -> SceneError:
        """Return the error to raise about this element.

        Parameters
        ----------
        message : str
            The message.

        Returns
        -------
        SceneError
            The error.
        """
        return SceneError(f"{self.place + ': ' if self.place else ''}<{self.element}> {message}")


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
