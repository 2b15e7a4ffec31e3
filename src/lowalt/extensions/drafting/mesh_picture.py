"""A picture of a mesh as its file has it: three views, with what may be rotors or wheels."""

import numpy as np
from matplotlib import pyplot as plt

from lowalt.extensions.drafting.inspection import Inspection
from lowalt.report.figures.style import png

DIRECTIONS = ((0, 1), (1, 2), (0, 2))


def _colours(inspection: Inspection) -> np.ndarray:
    """One colour a point (K, 4): grey, and one for each component that may move."""
    table = plt.get_cmap("tab10")
    moving = [part.number for part in inspection.components if part.guess]
    result = np.tile([0.6, 0.6, 0.63, 1.0], (len(inspection.points), 1))
    for index, number in enumerate(moving):
        result[inspection.owner == number] = table(index % 10)
    return result


MOST_NUMBERS = 60
"""Most pieces that a picture numbers, the largest first."""


def inspection_picture(inspection: Inspection, numbered: bool = False) -> bytes:
    """Return a PNG of an inspected mesh, in metres along the file's axes.

    Pieces that may move are in colours.

    numbered: whether the largest pieces have their numbers, from 1 in the order of the inspection.
    """
    figure, panels = plt.subplots(1, 3, figsize=(14, 5))
    colours = _colours(inspection)
    middle = (inspection.low + inspection.high) / 2
    half = 0.58 * float((inspection.high - inspection.low).max())
    front = "xyz".index(inspection.front[-1])
    up = "xyz".index(inspection.up[-1])
    right = 3 - front - up
    is_bird = inspection.category == "Bird"
    for panel, (across, high) in zip(panels, DIRECTIONS, strict=True):
        x = inspection.points[:, across]
        y = inspection.points[:, high]
        panel.scatter(x, y, s=4, c=colours, linewidths=0)
        for number, part in enumerate(inspection.components, 1):
            word = part.guess
            if numbered and number <= MOST_NUMBERS:
                word = str(number)
            if word:
                panel.text(part.centre[across], part.centre[high], word, fontsize=8, ha="center")
        if is_bird and right in (across, high):
            line = panel.axvline if across == right else panel.axhline
            for side in (-1, 1):
                at = middle[right] + side * inspection.shoulder_m
                line(at, color="tab:red", linewidth=0.8, linestyle="--")
        limits = np.array([-half, half])
        panel.set(xlim=middle[across] + limits, ylim=middle[high] + limits, aspect="equal")
        panel.set(xlabel=f"the file's {'xyz'[across]} (m)", ylabel=f"the file's {'xyz'[high]} (m)")
        panel.grid(alpha=0.25)
    unit = f"unit {inspection.unit} ({inspection.unit_from})"
    words = f"{inspection.path.name}: {unit}; guessed: up {inspection.up}, front {inspection.front}"
    if is_bird:
        words += ", wings beyond the dashed lines"
    figure.suptitle(words.replace("$", r"\$"))
    figure.tight_layout()
    return png(figure)
