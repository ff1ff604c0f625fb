"""The program whose jobs are measured: this checkout's, or that of an installed wheel.

`FRACSLICE_COMMAND=/path/to/venv/bin/fracslice` names another. The benchmarks of jobs import nothing of
fracslice, so a venv with a wheel and no checkout's build runs them, too.
"""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path

_BESIDE = Path(sys.executable).with_name("fracslice")
_OWN = str(_BESIDE) if _BESIDE.exists() else "fracslice"
COMMAND = shlex.split(os.environ.get("FRACSLICE_COMMAND", _OWN))
