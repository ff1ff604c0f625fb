"""What can go wrong, one class per stage. The message is one line that a person can act on."""


class FracsliceError(Exception):
    """Base of every error the library raises on purpose."""


class SceneError(FracsliceError):
    """A scene cannot be read or makes no sense; the message names file and line where known."""


class KernelError(FracsliceError):
    """A distance kernel cannot be linked or compiled."""


class DeviceError(KernelError):
    """There is no such device to compute on."""


class VolumeError(FracsliceError):
    """A volume cannot be sampled, read or written."""


class TooLargeError(VolumeError):
    """A job needs more memory than there is."""


class MeshError(FracsliceError):
    """A mesh cannot be built, read or made into a solid."""


class ExportError(FracsliceError):
    """A file cannot be written."""


class RenderError(FracsliceError):
    """A picture cannot be made."""


class SliceError(FracsliceError):
    """Layers cannot be cut or written."""


class BenchError(FracsliceError):
    """A benchmark cannot be run as asked."""


class Cancelled(FracsliceError):  # noqa: N818  it is no fault
    """The caller asked to stop."""


class FracsliceWarning(UserWarning):
    """Something was done another way than might be expected; the result is right."""
