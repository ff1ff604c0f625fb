"""Records whose fields have parameter kinds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, fields
from typing import Any, TypeVar

from .conversion import shown
from .parameters import REQUIRED, Parameter

R = TypeVar("R")


def attribute(kind: type[Parameter], *values: Any, **limits: Any) -> Any:
    """Return a dataclass field of a parameter kind.

    Parameters
    ----------
    kind : type of Parameter
        Class of the parameter kind.
    *values
        Default and description.
    **limits
        Further arguments of the class.
    """
    made = kind(*values, **limits)
    return field(default=made.default, metadata={"kind": made})


def kinds_of(record: Any) -> dict[str, Any]:
    """Return the parameter kinds of a record's fields.

    Parameters
    ----------
    record : dataclass or its class
        The record.

    Returns
    -------
    dict of str to Parameter
        Kinds by field name; other fields are left out.
    """
    return {f.name: f.metadata["kind"] for f in fields(record) if "kind" in f.metadata}


def validate(record: Any, fail: Callable[[str], Exception]) -> None:
    """Validate and convert fields of a frozen record in place. None is kept where it is the default.

    Parameters
    ----------
    record : dataclass
        The record, with fields of `attribute`.
    fail : callable
        Makes the exception to raise from the message "name=value: expected ...".
    """
    for name, kind in kinds_of(record).items():
        value = getattr(record, name)
        if value is not None or kind.default is not None:
            object.__setattr__(record, name, validated(name, value, kind, fail))


def validated(name: str, value: Any, kind: Any, fail: Callable[[str], Exception]) -> Any:
    """Validate and convert one value.

    Parameters
    ----------
    name : str
        Name in the message.
    value : object
        The value.
    kind : Parameter
        Its kind.
    fail : callable
        Makes the exception to raise from the message "name=value: expected ...".

    Returns
    -------
    object
        The value in the kind's type.
    """
    try:
        return kind.check(value)
    except ValueError as error:
        raise fail(f"{name}={shown(value)}: expected {error}") from None


def from_table(
    kind: type[R], where: str, values: Mapping[str, Any], fail: type[Exception], also: str = "", **given: Any
) -> R:
    """Make a record from the values of a file.

    Parameters
    ----------
    kind : dataclass
        Class of the record, with fields of `attribute`.
    where : str
        File, for messages.
    values : mapping
        Values by field; fields with a default may be absent.
    fail : type of Exception
        Class of the error, whose message is one line.
    also : str, optional
        Other expected keys, for messages.
    **given
        Fields that a file does not have.

    Returns
    -------
    dataclass
        The record.

    Raises
    ------
    Exception
        An error of `fail` for an unknown or missing key, or an invalid value.
    """
    known = {f.name: f.default for f in fields(kind) if f.name not in given}  # type: ignore[arg-type]
    if unknown := sorted(values.keys() - known.keys()):
        raise fail(f"{where}: {unknown[0]!r}: unknown; expected {', '.join(known)}{also}")
    if missing := [name for name, default in known.items() if default is REQUIRED and name not in values]:
        raise fail(f"{where}: {missing[0]} is missing")
    try:
        return kind(**values, **given)
    except fail as error:
        raise fail(f"{where}: {error}") from None
