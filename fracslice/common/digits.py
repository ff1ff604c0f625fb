"""Numbers in messages."""

from __future__ import annotations

from collections.abc import Iterable


def significant(value: float, digits: int = 3) -> str:
    """Format a number with a few significant digits, without an exponent where it is large.

    Examples
    --------
    >>> significant(1938.7), significant(0.012345), significant(2e9, 2)
    ('1940', '0.0123', '2000000000')
    """
    return f"{float(f'{value:.{digits}g}'):.12g}"


def decimal(value: float) -> str:
    """Format a number with two decimals or, below a tenth, three significant digits.

    Examples
    --------
    >>> decimal(80), decimal(0.1), decimal(0.00041), decimal(0)
    ('80.00', '0.10', '0.00041', '0.00')
    """
    return significant(value) if 0 < value < 0.1 else f"{value:.2f}"


def place(at: Iterable[float], decimals: int = 2) -> str:
    """Format coordinates with a few decimals, without negative zeros.

    Examples
    --------
    >>> place([1.234, -0.001, 30])
    '1.23 0.00 30.00'
    """
    return " ".join(f"{round(x, decimals) + 0.0:.{decimals}f}" for x in at)


def counted(count: int, one: str, more: str = "") -> str:
    """Format a count with its noun.

    Parameters
    ----------
    count : int
        Number.
    one, more : str
        Singular and plural; the plural is the singular and an s if not given.

    Examples
    --------
    >>> counted(1, "layer"), counted(13068, "triangle"), counted(2, "cavity", "cavities")
    ('1 layer', '13,068 triangles', '2 cavities')
    """
    return f"{count:,} {one if count == 1 else more or one + 's'}"
