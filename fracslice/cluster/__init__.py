"""One job on several machines: tasks are made by workers, and their results are files that all can reach."""

from .pool import Pool, Shard, Task
from .result_folder import PAGE, Contents, Files, ResultFolder, pack_arrays, unpack_arrays
from .workers import HIDDEN, Workers, connect

__all__ = [
    "HIDDEN",
    "PAGE",
    "Contents",
    "Files",
    "Pool",
    "ResultFolder",
    "Shard",
    "Task",
    "Workers",
    "connect",
    "pack_arrays",
    "unpack_arrays",
]
