"""Entry point: runs a command, prints errors as one line and returns the exit status.

Exit status: 0 success; 1 failure; 2 bad input or usage; 128 + n when stopped by signal n (Ctrl-C: 130).
"""

from __future__ import annotations

import builtins
import errno
import gc
import os
import signal
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from keyword import iskeyword
from typing import Any, NoReturn, TextIO

import click

from fracslice.common.parameters import alternatives
from fracslice.errors import (
    BenchError,
    DeviceError,
    ExportError,
    FracsliceError,
    FracsliceWarning,
    RenderError,
    SceneError,
    SharedError,
    SliceError,
    VolumeError,
)
from fracslice.formats import ENDINGS
from fracslice.version import __version__

from .execution import NOTHING, StoppedError

NAMES = (
    "animate",
    "bench",
    "calibrate",
    "check",
    "cut",
    "explore",
    "fill",
    "fly",
    "formulas",
    "import",
    "mesh",
    "orient",
    "plate",
    "print",
    "render",
    "repair",
    "scenes",
    "show",
    "slice",
    "studio",
)
"""Commands: functions in modules of their names, with an underscore behind that of a builtin or a keyword."""

FEWEST = 500_000
"""New objects between two garbage collections; the modules of a command have fewer."""

BAD_INPUT = (DeviceError, SceneError, RenderError, VolumeError, ExportError, SliceError, BenchError)
FAILED, USAGE, INTERRUPTED = 1, 2, 130

LACKS_MEMORY = "can't start new thread", "failed to map segment"
"""Words of errors where a thread's stack or a library does not fit into the memory."""


class Commands(click.Group):
    """Group that imports a command when it runs: importing all takes a tenth of a small job."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands."""
        return list(NAMES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of a name."""
        if cmd_name in NAMES and cmd_name not in self.commands:
            reserved = iskeyword(cmd_name)
            module = import_module(f".{cmd_name}_" if reserved else f".{cmd_name}", __package__)
            name = f"{cmd_name}_" if reserved or hasattr(builtins, cmd_name) else cmd_name
            self.add_command(getattr(module, name))
        return super().get_command(ctx, cmd_name)

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """Read the options, as `invoke` runs a command: help imports all of them."""
        with stoppable():
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; Ctrl-C, also during its imports, raises `StoppedError`."""
        with stoppable():
            return super().invoke(ctx)


@contextmanager
def stoppable() -> Iterator[None]:
    """Raise `StoppedError` for Ctrl-C; click would print an empty line."""
    try:
        yield
    except KeyboardInterrupt:
        raise StoppedError(signal.SIGINT, NOTHING) from None


HELP = f"""Fractals as signed distance fields, made into printable meshes, slices and pictures.

SCENE is an .xml file, or the name of a scene that ships with fracslice (see fracslice scenes). MODEL is
a file of {alternatives(*ENDINGS)}. A LENGTH is in mm, or has a unit: mm, cm, m, in or um.
"""


@click.group(
    cls=Commands,
    help=HELP,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, message="%(prog)s %(version)s")
@click.pass_context
def commands(context: click.Context) -> None:
    """Print the help without a command."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
        context.exit(USAGE)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run one command and exit with its status."""
    try:
        prepare()
        status = run(arguments)
    except KeyboardInterrupt:
        status = say(f"stopped; {NOTHING}", INTERRUPTED)
    gc.freeze()
    sys.exit(status)


def prepare() -> None:
    """Set threads, garbage collection and memory of this process."""
    from fracslice.common.memory import keep_freed_memory

    # The products of matrices here are small: threads of OpenBLAS would only take time to start.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Modules are no garbage: looking for it among them, at last at the exit, takes a fifth of a small job.
    gc.set_threshold(FEWEST)
    keep_freed_memory()


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command."""
    try:
        with warnings.catch_warnings():
            warnings.showwarning = show_warning
            return commands.main(arguments, prog_name="fracslice", standalone_mode=False) or 0
    except click.UsageError as error:
        hint = f" (see {error.ctx.command_path} --help)" if error.ctx else ""
        return say(error.format_message() + hint, error.exit_code)
    except click.ClickException as error:
        return say(error.format_message(), error.exit_code)
    except StoppedError as error:
        return say(str(error), error.status)
    except SharedError as error:
        return say(str(error), 0)
    except FracsliceError as error:
        return say(str(error), USAGE if isinstance(error, BAD_INPUT) else FAILED)
    except (KeyboardInterrupt, click.Abort):
        return say(f"stopped; {NOTHING}", INTERRUPTED)
    except (MemoryError, RuntimeError, ImportError) as error:
        if not isinstance(error, MemoryError) and not any(words in str(error) for words in LACKS_MEMORY):
            raise
        return say("out of memory: a coarser voxel or a smaller picture needs less", FAILED)
    except BrokenPipeError:
        # Without it, Python fails to flush stdout at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except OSError as error:
        status = USAGE if error.errno == errno.ENAMETOOLONG else FAILED
        return say(f"{error.filename or 'error'}: {error.strerror or error}", status)


def show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Show a warning of fracslice as one line, any other in Python's format."""
    if issubclass(category, FracsliceWarning):
        say(str(message), 0)
    else:
        text = warnings.formatwarning(message, category, filename, lineno, line)
        click.echo(text, file or sys.stderr, nl=False)


def say(message: str, status: int) -> int:
    """Print a message as one line on stderr and return the status."""
    click.echo(f"fracslice: {' '.join(message.split())}", err=True)
    return status
