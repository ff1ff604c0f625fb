"""Films: a scene over time, its frames and their files."""

from .encode import ENDINGS, check_film, encode
from .film import FilmJob, write_frames
from .flight import flown
from .timeline import Timeline

__all__ = ["ENDINGS", "FilmJob", "Timeline", "check_film", "encode", "flown", "write_frames"]
