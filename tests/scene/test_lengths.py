import math

import pytest

from fracslice.errors import SceneError
from fracslice.scene import parse_length


@pytest.mark.parametrize(
    ("text", "mm"),
    [
        ("80mm", 80),
        ("80", 80),
        (80, 80),
        (0.5, 0.5),
        (" 8 cm ", 80),
        ("1in", 25.4),
        ("250um", 0.25),
        ("250µm", 0.25),
        ("0.08m", 80),
        (".5mm", 0.5),
        ("5.mm", 5),
        ("1e2mm", 100),
        ("+3mm", 3),
    ],
)
def test_lengths_are_in_mm(text, mm):
    assert math.isclose(parse_length(text), mm, rel_tol=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "mm",
        "0",
        "0mm",
        "-0",
        "-1mm",
        "nan",
        "nanmm",
        "inf",
        "infinity",
        "1e400",
        "1e9m",
        "1e-9mm",
        "80 furlongs",
        "8 0mm",
        "80mm.",
        "1_0mm",
        "٣mm",
        "0x10mm",
        0,
        -1.0,
        math.nan,
        math.inf,
        True,
        None,
    ],
)
def test_what_is_no_length_is_refused(text):
    with pytest.raises(SceneError, match=r"size .*expected a length above zero"):
        parse_length(text, "size")
