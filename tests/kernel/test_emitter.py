"""The compiler of loops against Python itself: control flow, kinds of numbers, one line for what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fracslice.errors import KernelError
from fracslice.expr.graph import NOTHING
from fracslice.expr.loops import Loop
from fracslice.expr.runtime import lane_count, load_object
from fracslice.fields.cpu import object_code

N = 7
HEAD = """\
from fracslice.expr.vocabulary import any_of, minimum, where
from fracslice.expr.loops import WIDTH, load, store
from fracslice.expr.loops import loop
"""


def made(folder: Path, body: str, extra: str = "") -> Loop:
    """A loop ``run`` in a file of its own, on numbers ``A`` and ``J``, which writes ``F`` and ``K``."""
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    path = folder / "written.py"
    path.write_text(f'{HEAD}{extra}\n@loop("ririn")\ndef run(A, J, F, K, n):\n{lines}')
    scope: dict[str, Loop] = {}
    exec(compile(path.read_text(), path, "exec"), scope)
    return scope["run"]


def compiled(folder: Path, body: str, extra: str = "") -> dict[str, np.ndarray]:
    """What ``F`` and ``K`` hold after a loop ran, as Python and compiled."""
    loop, rows = made(folder, body, extra), {}
    for way in ("python", "compiled"):
        a = np.array([-2.5, -1.0, 0.0, 0.25, 1.0, 3.5, 100.0])
        j = np.array([-7, -3, -1, 0, 2, 5, 1 << 20], np.int32)
        f, k = np.zeros(64), np.zeros(64, np.int32)
        if way == "python":
            loop.function(a, [int(v) for v in j], f, k, N)
        else:
            code = object_code(NOTHING, 64, lane_count(64), [loop])
            load_object(code, [loop], np.dtype(np.float64))["run"](a, j, f, k, N)
        rows[way] = np.concatenate([f, k])
    return rows


SAME = {
    "whole numbers": (
        "for i in range(n):\n"
        "    K[i] = J[i] // 3 + J[i] % 4 * 2 - (J[i] >> 1) + (J[i] & 6) + (J[i] ^ 5) + (J[i] | 1)\n"
        "    K[8 + i] = J[i] // -3 - J[i] % -4\n"
        "    F[i] = J[i] / 3"
    ),
    "comparisons": (
        "for i in range(n):\n"
        "    K[i] = (A[i] < J[i]) + 2 * (A[i] == 1) + 4 * (J[i] != 5) + 8 * (A[i] >= 0.25)\n"
        "    F[i] = (J[i] == 2) - 1.0 * (J[i] <= -1)"
    ),
    "what is not looked at is not computed": (
        "i = 0\n"
        "while i < n and A[i] < 50.0:\n"
        "    i += 1\n"
        "K[0] = i\n"
        "K[1] = 1 if i < 3 or A[i] > 99.0 else 0\n"
        "K[2] = 1 if not i == 3 else 0"
    ),
    "a name that widens in a loop": (
        "total = 0\n"
        "most = 0\n"
        "for i in range(n):\n"
        "    for k in range(2, 8, 2):\n"
        "        total = total + A[i] * k\n"
        "        most = max(most, k)\n"
        "F[0] = total\n"
        "K[0] = most"
    ),
    "loops left early": (
        "last = 0\n"
        "for i in range(n):\n"
        "    if A[i] > 0.5:\n"
        "        break\n"
        "    last = i\n"
        "F[0] = last\n"
        "count = 0\n"
        "while True:\n"
        "    count += 3\n"
        "    half = count * 0.5\n"
        "    if count > 10:\n"
        "        break\n"
        "F[1] = half"
    ),
    "branches": (
        "for i in range(n):\n"
        "    if A[i] < 0.0:\n"
        "        v = -1\n"
        "    elif A[i] < 1.0:\n"
        "        v = A[i]\n"
        "    else:\n"
        "        v = 2\n"
        "        if J[i] > 100:\n"
        "            v = 3.5\n"
        "    F[i] = v\n"
        "    F[8 + i] = min(max(A[i], -1.0), 2) if A[i] == A[i] else 0"
    ),
    "tuples": "a, b = A[0], A[1]\np = (b, a, 3)\nfor i in range(3):\n    F[i] = p[i]\nF[3] = p[1]",
    "int": "for i in range(n):\n    K[i] = int(A[i] * 2.0)",
}


@pytest.mark.parametrize("name", SAME)
def test_a_loop_does_what_python_does(name: str, tmp_path: Path) -> None:
    rows = compiled(tmp_path, SAME[name])
    np.testing.assert_array_equal(rows["compiled"], rows["python"])
    assert rows["python"].any()


def test_functions_return_from_where_they_are(tmp_path: Path) -> None:
    extra = (
        "def sized(v, least):\n    if v < least:\n        return least, 0\n    return v, 1\n"
        "def count(v):\n    for i in range(10):\n        if v < i:\n            return i\n    return 99"
    )
    body = "for i in range(n):\n    v, w = sized(A[i], 1)\n    F[i] = v + w\n    K[i] = count(A[i])"
    rows = compiled(tmp_path, body, extra)
    np.testing.assert_array_equal(rows["compiled"], rows["python"])


WRONG = {
    "F[0] = nothing": "'nothing' has no value here",
    "for i in range(n):\n    a = A[i]\nF[0] = i": "'i' has no value here",
    "if n > 2:\n    a = 1.0\nF[0] = a": "'a' has no value here",
    "if load(A, 0) > 0.0:\n    F[0] = 1.0": "may differ from point to point",
    "F[0] = A[0] % 1.0": "whole numbers only",
    "F[0] = any_of(load(A, 0))": "a condition is expected",
    "store(F, 0, load(A, 0) > 1.0)": "where a number is expected",
    "a, b = A[0]": "2 values are expected",
    "store(F, 0, minimum(A[0]))": "takes 2 values, found 1",
    "F[0] = where(A[0] > 1.0, 2.0)": "takes 3 values, found 2",
    "F[0] = nonsense(1.0)": "'nonsense' is no function",
    "F[0] = min(load(A, 0), 1.0)": "numbers that are the same everywhere",
}


@pytest.mark.parametrize("body", WRONG)
def test_what_cannot_be_compiled_is_one_line_with_its_place(body: str, tmp_path: Path) -> None:
    loop = made(tmp_path, body)
    wrong = 7 if body.startswith("if load") else 6 + len(body.splitlines())
    with pytest.raises(KernelError, match=rf"written.py:{wrong}: loop run: .*{WRONG[body]}") as caught:
        object_code(NOTHING, 64, lane_count(64), [loop])
    assert "\n" not in str(caught.value)


def test_functions_of_one_signature_are_of_one_type(tmp_path: Path) -> None:
    """Types of functions are kept for ever: a studio would need more memory after each change."""
    loop = made(tmp_path, "F[0] = A[0]")
    code = object_code(NOTHING, 64, lane_count(64), [loop])
    first, second = (load_object(code, [loop], np.dtype(np.float64))["run"] for _ in range(2))
    assert first is not second and type(first._call) is type(second._call)
