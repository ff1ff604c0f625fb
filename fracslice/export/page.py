"""Summary page of a print: one HTML file with its pictures inside."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT, MARGIN = 720, 220, 40
"""Size of the plot and the space for its labels, pixels."""

_STYLE = "body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}img,svg{max-width:100%}"


def page(
    title: str,
    lines: Sequence[str],
    verdict: str,
    problems: Sequence[str],
    tops: NDArray[np.float64],
    areas: NDArray[np.float64],
    picture: bytes,
) -> bytes:
    """Compose a summary page.

    `tops`, `areas`: float64 [n], mm, mm2.
    """
    image = b64encode(picture).decode("ascii")
    text = [
        "<!DOCTYPE html>",
        f'<html lang="en"><meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>',
        f"<h1>{escape(title)}</h1>",
        *(f"<p>{escape(line)}</p>" for line in lines),
        f"<h2>{escape(verdict.capitalize())}</h2>",
        *(["<ul>", *(f"<li>{escape(problem)}</li>" for problem in problems), "</ul>"] if problems else []),
        "<h2>Cross-section over height</h2>",
        "<p>The force that peels a layer from the film grows with its area.</p>",
        plot(tops, areas),
        "<h2>Worst layers</h2>",
        "<p>Red has nothing below it.</p>",
        f'<img alt="Worst layers" src="data:image/png;base64,{image}">',
        "</html>",
    ]
    return "\n".join([*text, ""]).encode()


def plot(tops: NDArray[np.float64], areas: NDArray[np.float64]) -> str:
    """Plot areas over height as SVG.

    `tops`, `areas`: float64 [n], mm, mm2.
    """
    most, high = max(float(areas.max(initial=0)), 1e-9), float(tops[-1])
    inner, tall = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
    column = np.minimum((tops / high * inner).astype(int), inner - 1)
    largest = np.full(inner, -1.0)
    np.maximum.at(largest, column, areas)
    shown = np.flatnonzero(largest >= 0)
    points = " ".join(f"{MARGIN + x},{MARGIN + tall * (1 - largest[x] / most):.1f}" for x in shown.tolist())
    bottom, label = HEIGHT - MARGIN, HEIGHT - MARGIN / 2
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" font-size="12">'
        f'<path d="M{MARGIN} {MARGIN}V{bottom}H{WIDTH - MARGIN}" fill="none" stroke="#888"/>'
        f'<polyline points="{points}" fill="none" stroke="#b25"/>'
        f'<text x="{MARGIN}" y="{MARGIN - 8}">{most:.4g} mm2</text>'
        f'<text x="{MARGIN}" y="{label}">0</text>'
        f'<text x="{WIDTH - MARGIN}" y="{label}" text-anchor="end">{high:.4g} mm</text></svg>'
    )
