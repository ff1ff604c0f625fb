"""Numbers in messages."""


def significant(value: float, digits: int = 3) -> str:
    """Format a number with a few significant digits, without an exponent where it is large.

    Examples
    --------
    >>> significant(1938.7), significant(0.012345), significant(2e9, 2)
    ('1940', '0.0123', '2000000000')
    """
    return f"{float(f'{value:.{digits}g}'):.12g}"


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
