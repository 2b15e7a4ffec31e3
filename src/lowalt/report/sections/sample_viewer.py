"""Section: a viewer of some samples: cloud, truth, echoes, spectra, probabilities of the networks."""

from collections.abc import Iterator

from lowalt.config.named_code import own_effects
from lowalt.files.atomic import slug
from lowalt.report import viewer
from lowalt.report.reported_run import ReportedRun
from lowalt.shards import ShardSet
from lowalt.shards.remake import Remaker, opened
from lowalt.targets.cloud import read_clouds


def viewed(
    shards: ShardSet, numbers: list[int], remaker: Remaker | None
) -> Iterator[viewer.ViewedSample]:
    """Yield samples of a data set by their numbers.

    remaker: makes signals again, None for a data set that does not say how.
    """
    effects = (shards.index.get("echo") or {}).get("effects")
    effect = "the scene's effects" if effects else viewer.WITHOUT
    for number in numbers:
        record = shards.record(number)
        signal = None
        if remaker is not None:
            signal = remaker.signal(record)
        yield viewer.ViewedSample(effect, record, shards.tile(number), signal)


def values(run: ReportedRun) -> dict:
    """Return the viewer's samples, the panels of a tile, and the sizes of images."""
    clouds = read_clouds(run.inputs.paths("clouds"))
    files = run.inputs.paths("predictions")
    groups = {name: row["unseen_protocol"] for name, row in run.targets.items()}
    unseen = {slug(name) for name, group in groups.items() if group == "unseen"}
    shards = run.shards
    numbers = viewer.chosen(shards, viewer.predicted_keys(files), unseen)
    keys = {shards.keys[number].decode() for number in numbers}
    echo = shards.index.get("echo")
    # The effects of a stranger's run may be code, so no page runs them.
    remaker = None
    if echo and not own_effects(echo["effects"]):
        remaker = opened(run.inputs.path("index"))
    return viewer.shown(
        viewed(shards, numbers, remaker),
        shards.renderer,
        clouds,
        groups,
        shards.classes,
        viewer.probabilities(files, keys, shards.classes),
        (viewer.PIXELS, run.config["recognition"]["size"]),
    )
