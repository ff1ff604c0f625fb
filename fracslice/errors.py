"""Exceptions and warnings, one exception class per pipeline stage.

Each message is one line that the user can act on.
"""

from collections.abc import Iterator
from contextlib import contextmanager


class FracsliceError(Exception):
    """Base class of every error that the library raises on purpose."""


class SceneError(FracsliceError):
    """Unreadable or invalid scene. The message names file and line where known."""


class KernelError(FracsliceError):
    """Failure to link or compile the kernel of a distance field."""


class DeviceError(KernelError):
    """Unknown or unavailable compute device."""


class VolumeError(FracsliceError):
    """Failure to sample, read or write a volume."""


class TooLargeError(VolumeError):
    """Job that needs more memory than is available."""


class GridError(VolumeError):
    """Grid of more bricks than can be numbered.

    Attributes
    ----------
    most : float
        Voxels along the longest side that fit.
    """

    most: float


class EmptyError(VolumeError):
    """Scene of which no sample is inside."""


class MeshError(FracsliceError):
    """Failure to build, read or repair a mesh."""


class ExportError(FracsliceError):
    """Failure to write a file."""


class RenderError(FracsliceError):
    """Failure to render an image."""


class SliceError(FracsliceError):
    """Failure to cut or write layers."""


class ClusterError(FracsliceError):
    """Failure of a cluster's scheduler, workers or shared storage."""


class SharedError(ClusterError):
    """Pieces of a shard are made, and another shard writes the output. This is no failure."""


class BenchError(FracsliceError):
    """Invalid or impossible benchmark."""


class Cancelled(FracsliceError):  # noqa: N818  cancellation is no error
    """Cancellation requested by the caller."""


class KeptError(Cancelled):
    """Cancelled work whose partial result was written; the message names it."""


@contextmanager
def keeping(text: str) -> Iterator[None]:
    """Let the message of work that is cancelled in a block name what was written before.

    Parameters
    ----------
    text : str
        What was written.

    Returns
    -------
    context manager
        Of the block.

    Raises
    ------
    KeptError
        When the work is cancelled.
    """
    try:
        yield
    except Cancelled:
        raise KeptError(text) from None


class FracsliceWarning(UserWarning):
    """Fallback to another method; the result is correct."""
