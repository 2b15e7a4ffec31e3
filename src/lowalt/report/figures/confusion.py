"""The figure of confusion matrices."""

import numpy as np
from matplotlib import pyplot as plt

from lowalt.report.figures.style import png


def confusion_matrices(counts: dict, categories: tuple[str, ...]) -> bytes:
    """Draw one row-normalised confusion matrix a (protocol, scheme), four a row; counts as `tables.confusion` gives."""
    across = min(len(counts), 4)
    down = -(-len(counts) // across)
    figure, panels = plt.subplots(down, across, figsize=(3.6 * across, 3.7 * down), squeeze=False)
    for panel in panels.flat[len(counts) :]:
        panel.set_axis_off()
    for panel, ((protocol, scheme), cells) in zip(panels.flat, counts.items(), strict=False):
        matrix = np.array([[cells.get((true, guess), 0) for guess in categories] for true in categories], float)
        share = 100 * matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
        panel.imshow(share, cmap="Blues", vmin=0, vmax=100)
        for row, column in np.ndindex(*share.shape):
            dark = share[row, column] > 50
            panel.text(column, row, f"{share[row, column]:.1f}", ha="center", va="center", color="w" if dark else "k")
        panel.set_xticks(range(len(categories)), categories, rotation=30)
        panel.set_yticks(range(len(categories)), categories)
        panel.set_title(f"{protocol}\n{scheme}", fontsize=9)
        panel.set(xlabel="recognised as (%)", ylabel="true")
    figure.tight_layout()
    return png(figure)
