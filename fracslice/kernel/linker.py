"""Linking of a scene to a self-contained Python module: only the functions it uses, its numbers as arguments.

Parts of a scene that differ in numbers only share one function, ``N0(x, y, z, P, P0)``. Their numbers lie in
the parameter array P from offset P0, followed by those of their child elements. A union of a hundred spheres
is thus one sphere and a loop, and scenes that differ in numbers only have the same text: editing a value
compiles nothing.

Shapes and CSG operators are called with their arguments read from P. `Fixed` arguments are substituted in a
copy of the function, where dead branches are dropped and loops over fixed tuples are unrolled. A domain
operator's copy calls its child by name. Identities are omitted.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import KernelError
from ..formulas.registry import Fixed, Node
from . import functions, source
from .arguments import read
from .dialects import OF_FORMULAS, FieldDialect
from .structure import Subroutine, link_tree

FIELD = "field"
"""Name of the field's function."""

LARGEST = 1 << 24
"""Largest number of parameters: a float32 holds every index."""

CALLED = "called"
"""Decorator of functions that are called, not inlined."""


@dataclass(frozen=True, eq=False)
class Linked:
    """Linked scene; equal if text and numbers are.

    Attributes
    ----------
    source
        Source text with the signed field ``field(x, y, z, P)``.
    parameters
        Parameters P, float64 [n].
    """

    source: str
    parameters: np.ndarray

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Linked) and self._contents == other._contents

    def __hash__(self) -> int:
        return hash(self._contents)

    @property
    def _contents(self) -> tuple[str, bytes]:
        return self.source, self.parameters.tobytes()

    @property
    def digest(self) -> str:
        """First 20 hexadecimal digits of the SHA-256 digest of the text."""
        return hashlib.sha256(self.source.encode()).hexdigest()[:20]


def link(root: Node) -> Linked:
    """Link a scene tree.

    Parameters
    ----------
    root
        Scene with resolved depths.

    Returns
    -------
    Linked
        Text and parameters.

    Raises
    ------
    KernelError
        If a depth is "auto" or a formula is not in the language.
    """
    linker = Linker()
    linker.field(root)
    return Linked(linker.text(), linker.numbers())


@dataclass
class Linker:
    """Writes functions and collects parameters.

    Attributes
    ----------
    given
        Names that the text gets from elsewhere.
    parameters
        Parameters P.
    functions
        Texts of the functions by name.
    called
        Names of the functions that are called, not inlined.
    tables
        Arrays that stand behind the numbers in P, each with the index of the number that is its offset.
    """

    given: frozenset[str] = frozenset()
    parameters: list[float] = field(default_factory=list)
    functions: dict[str, str] = field(default_factory=dict)
    called: set[str] = field(default_factory=set)
    tables: list[tuple[int, np.ndarray]] = field(default_factory=list)
    _parts: dict[Any, Subroutine] = field(default_factory=dict)
    _shared: dict[Any, str] = field(default_factory=dict)

    def field(self, root: Node) -> None:
        """Write the field of a scene tree.

        Parameters
        ----------
        root
            Scene with resolved depths.

        Raises
        ------
        KernelError
            If a depth is "auto" or a formula is not in the language.
        """
        call = link_tree(self, root, FieldDialect(self))
        self.functions[FIELD] = f"def {FIELD}(x, y, z, P):\n    return {call}"

    def part(self, prefix: str, key: tuple[Any, ...], write: Callable[[str], Subroutine]) -> Subroutine:
        """Return the function of a structure; write it once.

        Parameters
        ----------
        prefix
            Prefix of its name.
        key
            Structure.
        write
            Writes the function under a name.
        """
        if (prefix, *key) not in self._parts:
            self._parts[prefix, *key] = write(f"{prefix}{len(self._parts)}")
        return self._parts[prefix, *key]

    def argument(self, value: Any) -> str:
        """Append a value to P.

        Parameters
        ----------
        value
            Number or nested tuple of numbers, or an array for `intrinsics.gather`.

        Returns
        -------
        str
            Expression that reads the value back; of an array, the index of its first element in P.
        """
        if isinstance(value, np.ndarray):
            self.tables.append((len(self.parameters), value))
            value = 0.0
        return read(value, self.parameters)

    def numbers(self) -> np.ndarray:
        """Return P: the numbers, then each array once.

        Returns
        -------
        ndarray
            Parameters, float64 [n].

        Raises
        ------
        KernelError
            If a float32 could not hold every index.
        """
        numbers, arrays = np.array(self.parameters or [0.0], np.float64), {}
        end = len(numbers)
        for place, array in self.tables:
            if id(array) not in arrays:
                arrays[id(array)] = end, array
                end += array.size
            numbers[place] = arrays[id(array)][0]
        if end > LARGEST:
            raise KernelError(
                f"the pictures of a scene hold {end:,} numbers: expected at most {LARGEST:,} in all"
            )
        return np.concatenate([numbers, *(array.ravel() for _, array in arrays.values())])

    def share(
        self, function: Callable[..., Any], fixed: Sequence[tuple[str, Any]] = (), prefix: str = ""
    ) -> str:
        """Write a copy of the function with its fixed arguments substituted, once.

        Parameters
        ----------
        function
            Formula or helper.
        fixed
            Names and values of the fixed arguments.
        prefix
            Prefix of its name and of those of the functions it calls.

        Returns
        -------
        str
            Name of the copy.
        """
        suffix = "".join(f"_{k}_{v}" for k, v in sorted(fixed))
        name = prefix + function.__name__ + "".join(c if c.isalnum() else "_" for c in suffix)
        copy = source.shared(function, tuple(fixed), self.given)
        return self.add((prefix, function, tuple(fixed)), name, copy, prefix)

    def add(self, key: tuple[Any, ...], name: str, copy: source.Copy, prefix: str) -> str:
        """Write a copy and the functions it calls, once per key.

        Parameters
        ----------
        key
            Identity of the copy.
        name
            Preferred name.
        copy
            Text and called functions.
        prefix
            Prefix of the names of the functions it calls.

        Returns
        -------
        str
            Name of the copy, numbered if `name` is in use.
        """
        if key not in self._shared:
            taken = {*self._shared.values()}
            number = next(
                n for n in range(1, len(taken) + 2) if (f"{name}_{n}" if n > 1 else name) not in taken
            )
            name = self._shared[key] = f"{name}_{number}" if number > 1 else name
            self.functions[name] = self.renamed(copy, name, prefix)
        return self._shared[key]

    def renamed(self, copy: source.Copy, name: str, prefix: str) -> str:
        """Return the text of a copy under a name; write the functions that it calls."""
        names = {called: self.share(f, (), prefix) for called, f in copy.calls.items()}
        return copy.renamed({**names, copy.name: name})

    def named(self, name: str, tree: ast.FunctionDef, function: Callable[..., Any]) -> str:
        """Return the renamed text of a tree derived from a formula; write the functions it calls."""
        copy = source.copied(tree, function, self.given | self.functions.keys())
        return self.renamed(copy, name, OF_FORMULAS)

    def bind(self, name: str, function: Callable[..., Any], values: dict[str, Any]) -> None:
        """Write the function ``name(rest..., P)`` that calls a given function.

        Its arguments in `values` are read from P or fixed; the others stay open. An argument named P receives
        P.

        Parameters
        ----------
        name
            Name of the new function.
        function
            Function to call.
        values
            Values of some arguments by name.
        """
        fixed = {k: v.value for k, v in values.items() if isinstance(v, Fixed)}
        called = self.share(function, tuple(fixed.items()))
        names = [a for a in functions.parameters(function) if a not in fixed]
        passed = [self.argument(values[a]) if a in values else a for a in names]
        rest = [a for a in names if a not in values and a != "P"]
        self.functions[name] = (
            f"def {name}({', '.join([*rest, 'P'])}):\n    return {called}({', '.join(passed)})"
        )

    def text(self) -> str:
        """Return the text of all functions."""
        texts = (f"@{CALLED}\n{t}" if name in self.called else t for name, t in self.functions.items())
        return "\n\n\n".join(texts) + "\n"
