"""The stages' own commands over a whole small data set, as the workflow runs them."""

from pathlib import Path
from types import SimpleNamespace

from configured import SCHEMA, Stages
from lowalt.config.layers import merge
from lowalt.echo.__main__ import main as echo
from lowalt.files.atomic import slug
from lowalt.motion.__main__ import main as motion
from lowalt.noise.__main__ import main as noise
from lowalt.scene.__main__ import main as effects
from lowalt.shards import ShardSet
from lowalt.shards.__main__ import main as shards
from lowalt.shards.dataset import Dataset
from lowalt.targets.cloud import write as write_cloud
from lowalt.tiles.__main__ import main as tiles
from lowalt.workflow.run import Run
from options import words


def run_stages(dataset: Dataset, folder: Path, kind: str) -> Path:
    """Run the stages' own commands over a whole small data set, with the settings that the rules of
    the workflow give them; return the index.
    """
    run = Run.of(merge(dataset.config, {"shards": {"kind": kind}}), SCHEMA, None)
    stages = Stages(run)
    for name, cloud in dataset.clouds.items():
        write_cloud(folder / "clouds" / f"{slug(name)}.npz", cloud)
    written = []
    for chunk in run.plan.chunks:
        group, _, part = chunk.partition("-")
        job = SimpleNamespace(group=group, part=part)
        clouds = [folder / "clouds" / f"{name}.npz" for name in stages.motion.subtypes(job)]
        table, noisy, drawn = (folder / f"{chunk}{end}" for end in (".csv", ".npy", ".npz"))
        heard = [folder / f"{chunk}-{station}.npy" for station in run.stations]
        inputs = {"motion": table, "clouds": clouds}
        span = stages.motion.span(job)
        block = stages.motion.settings(job)
        motion([*span, *words(settings=block, clouds=clouds, group=group, out=table)])
        files = words(**inputs, station=run.stations, out=heard)
        powers = {}
        if dataset.config["effects"]:
            powers = {"powers": [folder / f"{chunk}-{station}-w.npy" for station in run.stations]}
            options = words(settings=stages.echo.settings_in_scene(job), power=powers["powers"])
            effects([*options, *files])
        else:
            echo([*words(settings=stages.echo.settings(job)), *files])
        noise(
            words(
                settings=stages.noise.settings(job), motion=table, echoes=heard, **powers, out=noisy
            )
        )
        files = {"signals": noisy, **(inputs if stages.tiles.reads_motion else {})}
        tiles(words(settings=stages.tiles.settings(job), **files, out=drawn))
        content = (
            {"echoes": heard, **powers} if kind == "recipe" else {"signals": noisy, "tiles": drawn}
        )
        block = stages.shards.settings(job)
        for fold in run.plan.folds(chunk):
            written.append(folder / "shards" / f"{group}-{fold}-{part}.tar")
            options = words(settings=block, **inputs, **content, fold=fold, out=written[-1])
            shards(["write", *options])
    index = folder / "shards" / "index.json"
    shards(words("index", settings=stages.shards.index_settings(None), shards=written, out=index))
    return index


def check_members(dataset: Dataset, stored: ShardSet) -> None:
    """Assert that a data set and shards hold the same samples, equal in every byte."""
    numbers = {key.decode(): number for number, key in enumerate(stored.keys.tolist())}
    assert len(dataset) == len(stored)
    for number in range(len(dataset)):
        place = numbers[dataset.key(number)]
        assert dataset.members(number, stored.kind) == stored.members(place)
        if stored.kind in ("signal", "recipe"):
            assert (dataset.signal(number) == stored.signal(place)).all()
        record = stored.record(place)
        record.pop("cube", None)
        assert dataset.record(number) == record
        assert dataset.labels[number] == stored.labels[place]
