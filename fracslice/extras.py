"""Optional dependencies, and the command that installs a missing one."""

from __future__ import annotations

import importlib.util


def lacking(module: str, use: str, package: str | None = None) -> str:
    """What to install for a use, in one line; nothing where the module is installed.

    >>> lacking("json", "files need")
    ''
    >>> lacking("no_such_module", "windows need", "no-such-package")
    'windows need no-such-package, which is not installed: pip install "no-such-package"'
    """
    if importlib.util.find_spec(module):
        return ""
    name = package or module
    return f'{use} {name}, which is not installed: pip install "{name}"'
