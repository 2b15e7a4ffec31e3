"""`python -m lowalt.recognition COMMAND`: from shards to models, predictions and tables."""

import json
import sys
from pathlib import Path

from lowalt.config.command import dispatch, name_backbone, parser, pick, run
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition.protocols import folds
from lowalt.recognition.schemes import PROTOCOLS, TABLE, Scheme, named, names
from lowalt.recognition.sources import name_sources, of_size


def _views(arguments: list[str]) -> None:
    """Write the cache of views of one shard. Settings: size; with --reduced also snr_db."""
    from lowalt.recognition.views import Reduced, cache_shard

    line = parser("lowalt.recognition views", _views.__doc__)
    line.add_argument("--index", required=True, help="index of the shards (.json)")
    line.add_argument("--shard", required=True, help="name of the shard, {group}-{fold}-{part}.tar")
    line.add_argument("--reduced", help="images of the shard's chunk at this size, from the tiles stage (.npy)")
    line.add_argument("--motion", help="with --reduced: motion table of the chunk")
    line.add_argument("--out", required=True, help="views to write (.npz)")
    given = line.parse_args(arguments)
    if (given.reduced is None) != (given.motion is None):
        raise InputError("expected both --reduced and --motion, or neither")
    size, *levels = pick(given.settings, "size", *(["snr_db"] if given.reduced else []))
    source = Reduced(Path(given.reduced), Path(given.motion), tuple(map(float, levels[0]))) if levels else None
    count = cache_shard(given.index, given.shard, size, given.out, source)
    print(f"{given.out}: {count} samples", file=sys.stderr)


def _freeze(arguments: list[str]) -> None:
    """Write the checksums of files, or check them. Settings: none ({})."""
    from lowalt.recognition.freeze import command

    command(arguments, _freeze.__doc__)


def _open(given, pairs: set, scheme: Scheme, size: int, placed: bool):
    """Return the samples of some (group, fold) pairs from the source that the command line names."""
    from lowalt.recognition.samples import ViewSamples
    from lowalt.recognition.views import ShardSamples

    if sum(source is not None for source in (given.views, given.index, given.dataset)) != 1:
        raise InputError("expected one of --views, --index and --dataset")
    if given.dataset is not None:
        from lowalt.recognition.made import DatasetSamples, opened

        return DatasetSamples(opened(given.dataset), scheme.columns, pairs, size, placed)
    if given.views is None:
        return ShardSamples(given.index, scheme.columns, pairs, size, placed)
    return of_size(ViewSamples(given.views, scheme.columns, pairs), size)


def _train(arguments: list[str]) -> None:
    """Train one scheme in one protocol. Settings: seed, size, colour_map, network, training, augmentation,
    classes."""
    from lowalt.recognition.freeze import verify
    from lowalt.recognition.runs import train
    from lowalt.recognition.samples import first_models

    line = parser("lowalt.recognition train", _train.__doc__)
    name_sources(line)
    line.add_argument("--protocol", required=True, choices=PROTOCOLS)
    line.add_argument("--scheme", required=True, help="name or slug of a row of --schemes")
    line.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    line.add_argument("--stations", nargs="+", required=True, help="names of the network's stations, in its order")
    line.add_argument("--tensorboard", action="store_true", help="write the metrics for TensorBoard too, to OUT/events")
    line.add_argument("--out", required=True, help="folder for model.pt, history.csv and run.json")
    given = line.parse_args(arguments)
    for sums in given.frozen:
        verify(sums)
    scheme = named(given.schemes, given.scheme, given.stations)
    pick(given.settings, "seed", "size", "colour_map", "network", "training", "augmentation", "classes")
    settings = scheme.settled(given.settings)
    samples = {
        part: _open(given, folds(given.protocol, part), scheme, settings["size"], placed=False)
        for part in ("train", "validation")
    }
    if scheme.share < 1:
        samples["train"].keep(first_models(samples["train"].facts, scheme.share))
    train(samples, scheme, given.protocol, settings, Path(given.out), given.tensorboard)


def _evaluate(arguments: list[str]) -> None:
    """Predict all validation and test samples of a model's protocol. Settings: batch, threads, precision, mirror."""
    from lowalt.recognition.freeze import verify
    from lowalt.recognition.runs import evaluate, load

    line = parser("lowalt.recognition evaluate", _evaluate.__doc__)
    name_sources(line)
    line.add_argument("--model", required=True, help="model.pt of a training run")
    name_backbone(line)
    line.add_argument("--trained-on", default="", help="name of the run that trained the model, where it is another")
    line.add_argument("--out", required=True, help="predictions to write (.csv), and the run's record (.json)")
    given = line.parse_args(arguments)
    for sums in given.frozen:
        verify(sums)
    trained = load(given.model, given.backbone)
    seen = ("seen_test",) if trained.protocol == "unseen" else ()
    pairs = set().union(*(folds(trained.protocol, part) for part in ("validation", "test", *seen)))
    found = _open(given, pairs, trained.scheme, trained.size, placed=True)
    evaluate(trained, found, given.settings, given.out, given.trained_on)


def _tables(arguments: list[str]) -> None:
    """Write accuracy.csv and its companions from prediction files. Settings: seed."""
    from lowalt.recognition import tables
    from lowalt.recognition.evaluated import Evaluated
    from lowalt.recognition.orderings import read_published

    line = parser("lowalt.recognition tables", _tables.__doc__)
    line.add_argument("--predictions", nargs="+", required=True, help="predictions (.csv), records next to them")
    line.add_argument("--published", help="the paper's accuracies (.csv), if there are any to compare with")
    line.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    line.add_argument("--out", required=True, help="folder for the tables")
    given = line.parse_args(arguments)
    (seed,) = pick(given.settings, "seed")
    published = read_published(given.published) if given.published else {}
    runs = [Evaluated(path) for path in given.predictions]
    tables.write(runs, names(given.schemes), published, given.out, seed)


def _transfer(arguments: list[str]) -> None:
    """Compare models of other runs with this run's own on its test samples. Settings: seed."""
    from lowalt.recognition import transfer
    from lowalt.recognition.evaluated import Evaluated

    line = parser("lowalt.recognition transfer", _transfer.__doc__)
    line.add_argument("--own", nargs="+", required=True, help="prediction files of this run's models (.csv)")
    line.add_argument("--other", nargs="+", required=True, help="of other runs' models, evaluated with --trained-on")
    line.add_argument("--configs", nargs="+", required=True, help="configuration of this run, then of the others")
    line.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    line.add_argument("--out", required=True, help="table to write (.csv)")
    given = line.parse_args(arguments)
    (seed,) = pick(given.settings, "seed")
    first, *others = map(load_yaml, given.configs)
    for other in others:
        transfer.check_folds(first, other)
    own, other = ([Evaluated(path) for path in paths] for paths in (given.own, given.other))
    transfer.write(own, other, names(given.schemes), given.out, seed)


def _distances(arguments: list[str]) -> None:
    """Write how far the subtypes of a category lie from each other. Settings: none ({})."""
    from lowalt.motion import read_table
    from lowalt.recognition import distances
    from lowalt.targets.cloud import read as read_cloud

    line = parser("lowalt.recognition distances", _distances.__doc__)
    line.add_argument("--clouds", nargs="+", required=True, help="all cloud files")
    line.add_argument("--motion", nargs="+", required=True, help="motion tables with a row of every subtype")
    line.add_argument("--out", required=True, help="table to write (.csv)")
    given = line.parse_args(arguments)
    pick(given.settings)
    motion = [row for path in given.motion for row in read_table(path)]
    distances.write(given.out, distances.rows([read_cloud(path) for path in given.clouds], motion))


def _score(arguments: list[str]) -> None:
    """Score anyone's predictions on a protocol's test part, against the shards' own labels. Settings: none ({})."""
    from lowalt.recognition.score import score

    line = parser("lowalt.recognition score", _score.__doc__)
    line.add_argument("--predictions", required=True, help="prediction file: key and class probabilities are enough")
    line.add_argument("--index", required=True, help="index of the shards")
    line.add_argument("--protocol", required=True, choices=PROTOCOLS)
    line.add_argument("--out", required=True, help="scores to write (.json)")
    given = line.parse_args(arguments)
    pick(given.settings)
    with replacing(given.out) as temporary:
        found = score(given.predictions, given.index, given.protocol)
        temporary.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")


def _export(arguments: list[str]) -> None:
    """Write a trained model as safetensors with a card, as a torch.export program or as ONNX. Settings: none ({})."""
    from lowalt.recognition.export import export
    from lowalt.recognition.runs import load

    line = parser("lowalt.recognition export", _export.__doc__)
    line.add_argument("--model", required=True, help="model.pt of a training run")
    name_backbone(line)
    line.add_argument("--out", required=True, help="file to write: .safetensors (and its card, .md), .pt2 or .onnx")
    given = line.parse_args(arguments)
    pick(given.settings)
    export(load(given.model, given.backbone), given.out)


COMMANDS = {
    "views": _views, "freeze": _freeze, "distances": _distances, "train": _train, "evaluate": _evaluate,
    "tables": _tables, "transfer": _transfer, "score": _score, "export": _export,
}  # fmt: skip


def main(arguments: list[str]) -> None:
    """Run one command of the stage.

    Raises: InputError for an unknown command.
    """
    dispatch("lowalt.recognition", COMMANDS, arguments)


if __name__ == "__main__":
    run(main)
