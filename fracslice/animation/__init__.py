"""Films: a scene over time, its frames and their files."""

from .encode import ENDINGS, check_film, encode, sheet_frames
from .film import FilmJob, write_frames
from .timeline import Timeline, with_flight

__all__ = [
    "ENDINGS",
    "FilmJob",
    "Timeline",
    "check_film",
    "encode",
    "sheet_frames",
    "with_flight",
    "write_frames",
]
