"""Command line interface: the only code that prints and exits."""

import sys

try:
    from .main import main
except KeyboardInterrupt:  # these imports take as long as a short command
    sys.stderr.write("fracslice: stopped; nothing was written\n")
    sys.exit(130)

__all__ = ["main"]
