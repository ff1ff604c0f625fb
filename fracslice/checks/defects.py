"""Defects of a mesh, by which it is no solid."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from ..mesh import Mesh
from ..mesh.checks import MeshReport
from . import Check
from .problems import Problem


class MeshEvidence(NamedTuple):
    """A mesh to check."""

    report: MeshReport  # its figures and counts of defects
    faults: tuple[str, ...]  # what its job, or the report, finds wrong
    mesh: Mesh | None  # mm; None if it is only in a file


def _defects(of: MeshEvidence) -> Iterator[Problem]:
    for text in of.faults:
        yield Problem("mesh", text)


CHECKS = (Check("mesh", "mesh", _defects, rank=0),)
