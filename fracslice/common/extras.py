"""Optional dependencies, and the command that installs a missing one."""

from __future__ import annotations

import importlib.util


def lacking(module: str, use: str, package: str | None = None) -> str:
    """Return the package to install for a use.

    Parameters
    ----------
    module
        Module that the use needs.
    use
        Use, with its verb.
    package
        Package of the module, if its name differs.

    Returns
    -------
    str
        Advice of one line; empty if the module is installed.

    Examples
    --------
    >>> lacking("json", "files need")
    ''
    >>> lacking("no_such_module", "windows need", "no-such-package")
    'windows need no-such-package, which is not installed: pip install "no-such-package"'
    """
    if importlib.util.find_spec(module):
        return ""
    name = package or module
    return f'{use} {name}, which is not installed: pip install "{name}"'
