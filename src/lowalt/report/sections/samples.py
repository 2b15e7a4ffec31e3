"""Section: a viewer of some samples: tile with axes, the networks' probabilities, the target's own motion in 3-D."""

from lowalt.report import viewer
from lowalt.report.run import Run
from lowalt.targets.cloud import read


def values(run: Run) -> dict:
    """Return the viewer's samples, the panels of a tile, and the sizes of images."""
    clouds = {cloud.subtype: cloud for cloud in map(read, run.inputs.paths("clouds"))}
    files = run.inputs.paths("predictions") if "predictions" in run.inputs else []
    groups = {name: row["unseen_protocol"] for name, row in run.targets.items()}
    panels = viewer.panels(run.shards.renderer)
    size = run.shards.index["render"]["images"]["size"]
    return {
        "data": viewer.samples(run.shards, clouds, files, groups), "panels": panels, "size": size,
        "shown": min(size, viewer.PIXELS), "rows": panels[-1]["row"] + 1, "columns": panels[-1]["column"] + 1,
    }  # fmt: skip
