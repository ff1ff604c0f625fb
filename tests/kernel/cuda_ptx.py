"""What Numba compiles a CUDA module to, without a GPU."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Sequence
from pathlib import Path

import pytest

from fracslice.expr import cuda_source
from fracslice.expr.language import Linked
from fracslice.expr.loops import Loop


def compiled(
    linked: Linked, bits: int, loops: Sequence[Loop], name: str, arguments: str, folder: Path
) -> str:
    """The PTX of one loop for compute capability 9.0, an H100 or H200.

    arguments: a letter each: "r" a real, "n" a whole number; "R", "I" arrays of reals and int32, "M", "N"
    2-D ones, "U" a 2-D one of uint8.
    """
    path = folder / "scene.py"
    path.write_text(cuda_source.module(linked, bits, loops))
    spec = importlib.util.spec_from_file_location("scene", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    names = ("numba.cuda", "numba.cuda.dispatcher", "numba.cuda.types")
    numba_cuda, dispatcher, types = (importlib.import_module(name) for name in names)
    real = types.float32 if bits == 32 else types.float64
    kinds = {"r": real, "n": types.int64}
    for letters, element in (("RM", real), ("IN", types.int32)):
        kinds |= {letter: types.Array(element, k, "C") for k, letter in enumerate(letters, 1)}
    kinds["U"] = types.Array(types.uint8, 2, "C")
    signature = tuple(kinds[letter] for letter in arguments)
    with pytest.MonkeyPatch.context() as patch:
        # Numba asks the GPU for its capability even where it is told one.
        patch.setattr(
            dispatcher, "get_current_device", lambda: type("H200", (), {"compute_capability": (9, 0)})
        )
        ptx, _ = numba_cuda.compile(getattr(module, name).py_func, signature, cc=(9, 0), output="ptx")
    return str(ptx)
