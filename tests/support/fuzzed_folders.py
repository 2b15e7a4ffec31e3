"""Commands that take the folder of a run, each with a good folder of which `fuzzing` damages one
file.
"""

import contextlib
import functools
import math
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import yaml

import lowalt
from fuzzed_seals import INDEX, YAML
from fuzzing import Reader
from lowalt.__main__ import main
from lowalt.config.layers import merge
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import runs
from lowalt.shards import ShardSet
from lowalt.shards.build import write_run
from run_folders import run_folder

CHANGES = {
    "run": "good",
    "targets": {"select": ["DJI Mini 2", "Crow"]},
    "motion": {"models": 3, "models_per_chunk": 3},
    "split": {"train": 1, "val": 1, "test": 1},
    "noise": {"snr_db": [math.inf]},
    "images": {"size": 32},
}
GOOD = "LOWALT_FUZZED_RUN"
"""Variable of the environment that names the run's folder."""
MODEL = Path("results/zoo/default-seen.safetensors").absolute()


def good_run() -> Path:
    """A finished run of six samples, without a trained model; the processes that fuzzing starts
    share it.
    """
    if GOOD in os.environ:
        return Path(os.environ[GOOD])
    folder = Path(tempfile.mkdtemp()) / "results" / "good"
    folder.parent.mkdir()
    run_folder(folder, 80, 5.0)
    config = merge(load_yaml("config/default.yaml"), CHANGES)
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    write_run(lowalt.Dataset(config), folder, "image")
    os.environ[GOOD] = str(folder)
    return folder


def _told(*words: str) -> None:
    """Run a command of `lowalt`. Raises: InputError with what it says where it refuses."""
    said: list[str] = []
    with mock.patch("builtins.print", lambda *texts, **more: said.extend(map(str, texts))):
        if main([*words]) == 2:
            raise InputError(" ".join(said).removeprefix("error: "))


def _train(run: Path) -> None:
    """Train on a run as far as the first step."""
    with mock.patch.object(runs, "train"), mock.patch.object(runs, "load"):
        lowalt.train(run, "A:VT", "seen", out=run / "model")


def _page(run: Path) -> None:
    """Ask for a run's page, as far as the start of the workflow."""
    # The command names the run by its place below the working directory.
    with (
        mock.patch("lowalt.commands.workflow.ended", return_value={"status": 0}),
        contextlib.chdir(run.parents[1]),
    ):
        _told("report", str(run))


def _gallery(run: Path) -> None:
    """Make the page of all runs."""
    _told("report", "--gallery", "--results", str(run.parent))


def _samples(run: Path) -> None:
    """Open a run's configuration as a data set, and its shards."""
    lowalt.Dataset(run / "config.yaml", clouds={})
    ShardSet(run / "shards/index.json")


COMMANDS: dict[str, Callable[[Path], object]] = {
    "compare": lambda run: _told("compare", str(run), str(good_run())),
    "gallery": _gallery,
    "page": _page,
    "verify": lambda run: _told("verify", str(run / "shards/index.json")),
    "train": _train,
    "evaluate": lambda run: lowalt.evaluate(MODEL, run),
    "data set": _samples,
}
FILES = {"config.yaml": YAML, "accuracy.csv": None, "stages.csv": None, "shards/index.json": INDEX}


def _on_folder(act: Callable[[Path], object], file: str, path: Path) -> object:
    """Act on a copy of the good run in which a file is as in `path`."""
    run = path.parent / "results" / "good"
    shutil.rmtree(run.parent, ignore_errors=True)
    shutil.copytree(good_run(), run)
    shutil.copyfile(path, run / file)
    return act(run)


READ = {
    "verify": ["shards/index.json"],
    "page": ["config.yaml"],
    **{name: ["config.yaml", "shards/index.json"] for name in ("train", "evaluate", "data set")},
}
"""The files of a run that a command reads, where it does not read all."""


def folders() -> list[Reader]:
    """Return a reader for each command and each file of a run that it reads."""
    return [
        Reader(
            f"{name} of a run: {file}",
            Path(file).name,
            (good_run() / file).read_bytes(),
            functools.partial(_on_folder, act, file),
            share=0.1,
            seal=FILES[file],
        )
        for name, act in COMMANDS.items()
        for file in READ.get(name, FILES)
    ]
