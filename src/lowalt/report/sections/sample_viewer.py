"""Section: a viewer of some samples: echoes, tile with axes, probabilities of the networks, motion
in 3-D.
"""

from lowalt.config.named_code import own_effects
from lowalt.report import viewer, viewer_echoes
from lowalt.report.reported_run import ReportedRun
from lowalt.shards.remake import opened
from lowalt.targets.cloud import read


def values(run: ReportedRun) -> dict:
    """Return the viewer's samples, the panels of a tile, and the sizes of images."""
    clouds = {cloud.subtype: cloud for cloud in map(read, run.inputs.paths("clouds"))}
    files = run.inputs.paths("predictions")
    groups = {name: row["unseen_protocol"] for name, row in run.targets.items()}
    network = run.shards.renderer.network
    pixels = run.config["recognition"]["size"]
    panels = viewer.panels(run.shards.renderer)
    size = run.shards.index["render"]["images"]["size"]
    echo = run.shards.index.get("echo")
    # The effects of a stranger's run may be code, so no page runs them.
    remaker = (
        opened(run.inputs.path("index")) if echo and not own_effects(echo["effects"]) else None
    )
    return {
        "data": viewer.samples(run.shards, remaker, clouds, files, groups, pixels),
        "panels": panels,
        "size": size,
        "shown": min(size, viewer.PIXELS),
        "rows": panels[-1]["row"] + 1,
        "columns": panels[-1]["column"] + 1,
        "pixels": pixels,
        "stations": run.stations,
        "floor_db": viewer_echoes.FLOOR_DB,
        "look_s": network.symbols * network.symbol_interval_s,
    }
