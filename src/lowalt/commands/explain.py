"""The command `lowalt explain`: whether a scene's receiver finds its targets, and why."""

import argparse
import dataclasses
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.blocks import render_blocks
from lowalt.config.layers import merge, overlaid
from lowalt.files.atomic import write_file
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.progress import announced
from lowalt.shards.plan import Plan
from lowalt.spectra.catalogue import named
from lowalt.targets.records import records_of
from lowalt.workflow.space import cubes_sentence, cubes_size


def _sample(text: str) -> tuple[str, int]:
    """Subtype and motion model of a text such as "Crow:3"."""
    name, _, model = text.rpartition(":")
    if not name or not model.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r}, expected SUBTYPE:MODEL such as 'Crow:3'")
    return name, int(model)


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `explain` to a parser's commands."""
    line = add_command(commands, name, run)
    line.add_argument(
        "scene",
        type=Path,
        nargs="+",
        help="the scene, an overlay on the default; more may follow it",
    )
    line.add_argument(
        "--sample", type=_sample, action="append", default=[], metavar="SUBTYPE:MODEL"
    )
    line.add_argument("--station", help="the station of the table of effects (default: the first)")
    line.add_argument(
        "--model", type=Path, help="a trained model: how many of its answers each effect changes"
    )
    line.add_argument("--no-table", action="store_true", help="the verdict alone")
    line.add_argument(
        "--levels",
        action="store_true",
        help="list the levels of every sample as a link budget does",
    )
    line.add_argument(
        "--sources", action="store_true", help="list where the model of each effect comes from"
    )
    line.add_argument(
        "--suggest",
        type=float,
        metavar="LEAST",
        help="write the effects that change a signal by more",
    )
    line.add_argument("--out", type=Path, help="the scene to write with --suggest (.yaml)")


def run(options: argparse.Namespace) -> Answer:
    """Explain a scene; a data set of cubes begins with its size.

    Raises: InputError where the configuration, a sample or a station is wrong.
    """
    if options.suggest is not None and options.out is None:
        raise InputError("--suggest: without --out, expected both")
    if options.out is not None and options.suggest is None:
        raise InputError("--out: expected --suggest")
    from lowalt.scene import explanation

    inputs = None
    if os.environ.get("LOWALT_INPUTS"):
        inputs = Path(os.environ["LOWALT_INPUTS"])
    config = overlaid(options.scene)
    size = _size(config, inputs)
    scene = explanation.scene_of(config)
    stations = scene.network.stations
    first = options.station or stations[0].name
    scene.network.station(first)
    print(
        "lowalt explain: making samples and, the first time, compiling", file=sys.stderr, flush=True
    )
    with announced("lowalt explain: making samples"):
        chosen = explanation.samples(config, inputs, options.sample)
    clouds = {sample.cloud.subtype: sample.cloud for sample in chosen}
    listed = options.levels or options.json
    findings = []
    with announced("lowalt explain: reading each station"):
        for sample in chosen:
            for station in stations:
                findings.append(explanation.finding(scene, station, sample, clouds, listed))
    changes = []
    if not options.no_table or options.suggest is not None:
        print("lowalt explain: leaving out and adding every effect", file=sys.stderr, flush=True)
        names = [first]
        if options.model:
            names = [station.name for station in stations]
        with announced("lowalt explain: leaving out and adding every effect"):
            changes = explanation.changes(
                config, chosen, names, _shown(config, names, options.model)
            )
    if options.out is not None:
        overlay: dict = {}
        for path in options.scene:
            overlay = merge(overlay, load_yaml(path))
        write_file(options.out, explanation.suggested(overlay, changes, options.suggest))
    return _answer(options, config["run"], size, findings, changes)


def _answer(
    options: argparse.Namespace, name: str, size: dict, findings: list, changes: list
) -> Answer:
    """The answer on the run `name`: size of its cubes, verdict, table of effects and levels."""
    from lowalt.scene import explanation

    lines = []
    facts: dict = {"run": name}
    if size:
        lines += [cubes_sentence(size), ""]
        facts["shards"] = size
    lines += explanation.verdict(findings)
    if changes and not options.no_table:
        lines += ["", *explanation.effects_table(changes, options.sources)]
    if options.levels:
        for finding in findings:
            lines += ["", *explanation.level_lines(finding)]
    facts["findings"] = [row._asdict() for row in findings]
    facts["changes"] = [row._asdict() for row in changes]
    return Answer(facts, "\n".join(lines))


def _size(config: dict, inputs: Path | None) -> dict:
    """The size of a scene's data set if its shards are cubes, else an empty mapping."""
    if config["shards"]["kind"] != "cube":
        return {}
    records = records_of(config["targets"], inputs)
    published = {name: record["published"] for name, record in records.items()}
    return cubes_size(config, Plan.of(config, published))


def _shown(
    config: dict, stations: list[str], model: Path | None
) -> Callable[[np.ndarray], dict[str, np.ndarray]]:
    """The function that turns signals (K, stations, N) into pixels and a model's answers."""
    from lowalt.config.network import Network
    from lowalt.tiles import Renderer

    blocks = render_blocks(config)
    whole = Renderer.from_settings(blocks)
    network = Network.from_settings(config["network"])
    seen = dataclasses.replace(network, stations=tuple(network.station(name) for name in stations))
    renderer = Renderer(seen, whole.spectra, whole.images)
    if model is not None:
        from lowalt.recognition.predict_sample import answer
        from lowalt.recognition.runs import opened
        from lowalt.tiles import split

        trained, _ = opened(model)

    def shown(signals: np.ndarray) -> dict[str, np.ndarray]:
        """Indices of all pixels, and the most probable class of each sample."""
        tiles = [renderer.tile(each.astype(np.complex64)) for each in signals]
        result = {"pixels": np.array(tiles, int)}
        if model is not None:
            images = len(named(config["spectra"]))
            shares = [answer(trained, split(tile, images), blocks, "--model") for tile in tiles]
            result["answers"] = np.array([max(each, key=each.__getitem__) for each in shares])
        return result

    return shown
