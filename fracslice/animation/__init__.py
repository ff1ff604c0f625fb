"""Films: a scene over time, its frames and their files."""

from .film import ENDINGS, FilmJob, check_film, encode, has_frames, sheet_frames, write_frames
from .timeline import Timeline, with_flight

__all__ = [
    "ENDINGS",
    "FilmJob",
    "Timeline",
    "check_film",
    "encode",
    "has_frames",
    "sheet_frames",
    "with_flight",
    "write_frames",
]
