"""The figure of confusion matrices."""

import numpy as np
from matplotlib import pyplot as plt

from lowalt.report.figures.style import png

CROWDED = 5
"""Most classes whose names stand side by side at the usual size."""


def confusion_matrices(counts: dict, categories: tuple[str, ...]) -> bytes:
    """Draw one row-normalised confusion matrix a (protocol, scheme); counts as `tables.confusion` gives.

    Up to four matrices stand in a row; of more than CROWDED classes they are larger, and fewer stand there. A class
    without samples has dashes in its row.
    """
    crowded = len(categories) > CROWDED
    side = 0.68 * len(categories) if crowded else 3.6
    across = min(len(counts), max(1, int(14.4 / side)))
    down = -(-len(counts) // across)
    figure, panels = plt.subplots(down, across, figsize=(side * across, (side + 0.1) * down), squeeze=False)
    for panel in panels.flat[len(counts) :]:
        panel.set_axis_off()
    slant = {"rotation": 45, "ha": "right", "rotation_mode": "anchor"} if crowded else {"rotation": 30}
    for panel, ((protocol, scheme), cells) in zip(panels.flat, counts.items(), strict=False):
        matrix = np.array([[cells.get((true, guess), 0) for guess in categories] for true in categories], float)
        share = 100 * matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
        panel.imshow(share, cmap="Blues", vmin=0, vmax=100)
        for row, column in np.ndindex(*share.shape):
            words = f"{share[row, column]:.1f}" if matrix[row].any() else "-"
            panel.text(column, row, words, ha="center", va="center", color="w" if share[row, column] > 50 else "k")
        panel.set_xticks(range(len(categories)), categories, **slant)
        panel.set_yticks(range(len(categories)), categories)
        panel.set_title(f"{protocol}\n{scheme}", fontsize=9)
        panel.set(xlabel="recognised as (%)", ylabel="true")
    figure.tight_layout()
    return png(figure)
