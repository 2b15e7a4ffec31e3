"""`python -m lowalt.recognition COMMAND`: from shards to models, predictions and tables."""

import gc
import json
import sys
from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from types import ModuleType

from lowalt.config.command import add_backbone_option, dispatch, parser, pick, run
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition.protocols import evaluated_folds
from lowalt.recognition.schemes import PROTOCOLS, TABLE, names, with_scheme


def _views(arguments: list[str]) -> None:
    """Write the cache of views of one shard. Settings: size; with --reduced also snr_db."""
    from lowalt.recognition.views import Reduced, cache_shard

    line = parser("lowalt.recognition views", _views.__doc__)
    line.add_argument("--index", required=True, help="index of the shards (.json)")
    line.add_argument("--shard", required=True, help="name of the shard, {group}-{fold}-{part}.tar")
    line.add_argument(
        "--reduced", help="images of the shard's chunk at this size, from the tiles stage (.npy)"
    )
    line.add_argument("--motion", help="with --reduced: motion table of the chunk")
    line.add_argument("--out", required=True, help="views to write (.npz)")
    options = line.parse_args(arguments)
    if (options.reduced is None) != (options.motion is None):
        raise InputError("expected both --reduced and --motion, or neither")
    source = None
    if options.reduced:
        size, snrs_db = pick(options.settings, "size", "snr_db")
        source = Reduced(Path(options.reduced), Path(options.motion), tuple(map(float, snrs_db)))
    else:
        (size,) = pick(options.settings, "size")
    count = cache_shard(options.index, options.shard, size, options.out, source)
    print(f"{options.out}: {count} samples", file=sys.stderr)


def _freeze(arguments: list[str]) -> None:
    """Write the checksums of files, or check them. Settings: none ({})."""
    from lowalt.recognition.freeze import freeze, verify

    line = parser("lowalt.recognition freeze", _freeze.__doc__)
    line.add_argument(
        "--files", nargs="+", help="clouds and motion tables, below the folder of --out"
    )
    line.add_argument(
        "--out", required=True, help="SHA256SUMS, written where --files is given, else checked"
    )
    options = line.parse_args(arguments)
    pick(options.settings)
    if options.files:
        freeze(options.files, options.out)
    print(f"{options.out}: {verify(options.out)} files as frozen", file=sys.stderr)


def _add_source(line: ArgumentParser) -> None:
    """Add the options that name the source of samples and the frozen files behind them."""
    line.add_argument("--views", nargs="+", help="caches of views (.npz)")
    line.add_argument(
        "--index", help="instead of --views: index of the shards, read sample by sample"
    )
    line.add_argument(
        "--dataset", help="instead of both: config.yaml of a run with clouds; samples are simulated"
    )
    line.add_argument(
        "--frozen",
        nargs="+",
        default=[],
        help="SHA256SUMS of clouds and motion tables, checked first",
    )


def _source(options: Namespace):
    """Return the source of samples that a command line names, after checking the frozen files."""
    from lowalt.recognition.freeze import verify
    from lowalt.recognition.sample_sources import Source

    for sums in options.frozen:
        verify(sums)
    if sum(source is not None for source in (options.views, options.index, options.dataset)) != 1:
        raise InputError("expected one of --views, --index and --dataset")
    if options.dataset is None:
        return Source(options.views, options.index)
    from lowalt.recognition.dataset_samples import DatasetSamples, opened

    return Source(made=partial(DatasetSamples, opened(options.dataset)))


def _runs() -> ModuleType:
    """Import the module that needs torch."""
    # Looking for garbage among all that torch makes takes a quarter of its import.
    gc.disable()
    from lowalt.recognition import runs

    gc.enable()
    return runs


def _train(arguments: list[str]) -> None:
    """Train one scheme in one protocol.

    Settings: scheme, seed, size, colour_map, network, training, augmentation, classes.
    """
    runs = _runs()
    line = parser("lowalt.recognition train", _train.__doc__)
    _add_source(line)
    line.add_argument("--protocol", required=True, choices=PROTOCOLS)
    line.add_argument(
        "--tensorboard",
        action="store_true",
        help="write the metrics for TensorBoard too, to OUT/events",
    )
    line.add_argument(
        "--out", required=True, help="folder for model.safetensors, history.csv and run.json"
    )
    options = line.parse_args(arguments)
    scheme, settings = with_scheme(options.settings)
    pick(settings, "seed", "size", "colour_map", "network", "training", "augmentation", "classes")
    samples = _source(options).for_training(scheme, options.protocol, settings["size"])
    out = Path(options.out)
    runs.train(samples, scheme, options.protocol, settings, out, options.tensorboard)


def _evaluate(arguments: list[str]) -> None:
    """Predict all validation and test samples of a model's protocol.

    Settings: batch, threads, precision, mirror.
    """
    runs = _runs()
    line = parser("lowalt.recognition evaluate", _evaluate.__doc__)
    _add_source(line)
    line.add_argument("--model", required=True, help="model.safetensors of a training run")
    add_backbone_option(line)
    line.add_argument(
        "--trained-on",
        default="",
        help="name of the run that trained the model, where it is another",
    )
    line.add_argument(
        "--out", required=True, help="predictions to write (.csv), and the run's record (.json)"
    )
    options = line.parse_args(arguments)
    source = _source(options)
    trained = runs.load(options.model, options.backbone)
    samples = source.samples(
        trained.scheme.columns, evaluated_folds(trained.protocol), trained.size, placed=True
    )
    runs.evaluate(trained, samples, options.settings, options.out, options.trained_on)


def _tables(arguments: list[str]) -> None:
    """Write accuracy.csv and its companions from prediction files. Settings: seed."""
    from lowalt.recognition import tables
    from lowalt.recognition.evaluated import Evaluated
    from lowalt.recognition.paper_claims import read_published

    line = parser("lowalt.recognition tables", _tables.__doc__)
    line.add_argument(
        "--predictions", nargs="+", required=True, help="predictions (.csv), records next to them"
    )
    line.add_argument(
        "--published", help="the paper's accuracies (.csv), if there are any to compare with"
    )
    line.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    line.add_argument("--out", required=True, help="folder for the tables")
    options = line.parse_args(arguments)
    (seed,) = pick(options.settings, "seed")
    published = read_published(options.published) if options.published else {}
    runs = [Evaluated(path) for path in options.predictions]
    tables.write(runs, names(options.schemes), published, options.out, seed)


def _transfer(arguments: list[str]) -> None:
    """Compare models of other runs with this run's own on its test samples. Settings: seed."""
    from lowalt.recognition import transfer
    from lowalt.recognition.evaluated import Evaluated

    line = parser("lowalt.recognition transfer", _transfer.__doc__)
    line.add_argument(
        "--own", nargs="+", required=True, help="prediction files of this run's models (.csv)"
    )
    line.add_argument(
        "--other",
        nargs="+",
        required=True,
        help="those of other runs' models (evaluate --trained-on)",
    )
    line.add_argument(
        "--configs", nargs="+", required=True, help="configuration of this run, then of the others"
    )
    line.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    line.add_argument("--out", required=True, help="table to write (.csv)")
    options = line.parse_args(arguments)
    (seed,) = pick(options.settings, "seed")
    first, *others = map(load_yaml, options.configs)
    for other in others:
        transfer.check_folds(first, other)
    own_models = [Evaluated(path) for path in options.own]
    other_models = [Evaluated(path) for path in options.other]
    transfer.write(own_models, other_models, names(options.schemes), options.out, seed)


def _distances(arguments: list[str]) -> None:
    """Write the distances between the subtypes of each category. Settings: none ({})."""
    from lowalt.motion import read_table
    from lowalt.recognition import distances
    from lowalt.targets.cloud import read as read_cloud

    line = parser("lowalt.recognition distances", _distances.__doc__)
    line.add_argument("--clouds", nargs="+", required=True, help="all cloud files")
    line.add_argument(
        "--motion", nargs="+", required=True, help="motion tables with a row of every subtype"
    )
    line.add_argument("--out", required=True, help="table to write (.csv)")
    options = line.parse_args(arguments)
    pick(options.settings)
    motion = []
    for path in options.motion:
        motion += read_table(path)
    clouds = [read_cloud(path) for path in options.clouds]
    distances.write(options.out, distances.rows(clouds, motion))


def _score(arguments: list[str]) -> None:
    """Score a prediction file on a protocol's test part by the shards' labels. Settings: none ({})."""
    from lowalt.recognition.score import score

    line = parser("lowalt.recognition score", _score.__doc__)
    line.add_argument(
        "--predictions",
        required=True,
        help="prediction file: key and class probabilities are enough",
    )
    line.add_argument("--index", required=True, help="index of the shards")
    line.add_argument("--protocol", required=True, choices=PROTOCOLS)
    line.add_argument("--out", required=True, help="scores to write (.json)")
    options = line.parse_args(arguments)
    pick(options.settings)
    with replacing(options.out) as temporary:
        scores = score(options.predictions, options.index, options.protocol)
        temporary.write_text(json.dumps(scores, indent=1, sort_keys=True) + "\n")


def _export(arguments: list[str]) -> None:
    """Write a trained model as safetensors with a card, or as ONNX. Settings: none ({})."""
    from lowalt.recognition.export import export
    from lowalt.recognition.runs import load

    line = parser("lowalt.recognition export", _export.__doc__)
    line.add_argument("--model", required=True, help="model.safetensors of a training run")
    add_backbone_option(line)
    line.add_argument(
        "--out", required=True, help="file to write: .safetensors (and its card, .md) or .onnx"
    )
    options = line.parse_args(arguments)
    pick(options.settings)
    export(load(options.model, options.backbone), options.out)


COMMANDS = {
    "views": _views,
    "freeze": _freeze,
    "distances": _distances,
    "train": _train,
    "evaluate": _evaluate,
    "tables": _tables,
    "transfer": _transfer,
    "score": _score,
    "export": _export,
}


def main(arguments: list[str]) -> None:
    """Run one command of the stage.

    Raises: InputError for an unknown command.
    """
    dispatch("lowalt.recognition", COMMANDS, arguments)


if __name__ == "__main__":
    run(main)
