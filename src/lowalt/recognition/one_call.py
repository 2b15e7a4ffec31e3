"""Training and evaluation on the data set of a finished run, in one call each."""

from pathlib import Path

from lowalt.config.network import station_names
from lowalt.files.errors import InputError
from lowalt.files.shipped import located
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import inference, runs, zoo
from lowalt.recognition.inference import Machine
from lowalt.recognition.protocols import folds
from lowalt.recognition.sample_sources import Source
from lowalt.recognition.schemes import named
from lowalt.recognition.score import scores
from lowalt.shards import ShardSet


def train(
    run: str | Path, scheme: str = "ABC:VRP+TRP+VT", protocol: str = "unseen", seed: int = 0,
    out: str | Path = "model", **training: object,
) -> runs.Trained:  # fmt: skip
    """Train a scheme on the data set of a finished run and return the model, which stays in `out`/model.pt.

    run: its folder, such as results/default; scheme: a name of config/schemes.csv; protocol: "unseen" trains on twenty
    subtypes and tests on the others, "seen" trains and tests on other motion of all; training: settings that replace
    the run's own, such as steps=500. A training that was interrupted goes on.
    Raises: InputError for a run that is not finished, or a wrong name or setting.
    """
    config, index = _opened(run)
    block = config["recognition"]
    chosen = named(block["table"], scheme, station_names(config["network"]))
    settings = chosen.settled({
        **{name: block[name] for name in ("size", "network", "augmentation")}, "seed": seed,
        "training": {**block["training"], **training}, "colour_map": config["images"]["colour_map"],
        "classes": list(ShardSet(index).classes),
    })  # fmt: skip
    samples = Source.of_run(index, settings["size"]).for_training(chosen, protocol, settings["size"])
    runs.train(samples, chosen, protocol, settings, Path(out))
    return runs.load(Path(out) / "model.pt")


def evaluate(model: runs.Trained | str | Path, run: str | Path) -> dict:
    """Return how a trained model does on the test samples of its protocol in the data set of a finished run.

    model: of `train`, a file (model.pt or .safetensors), or a name of the zoo; run: a folder such as results/default.
    The result has `accuracy_percent`, the mean over the SNRs, `by_snr_percent`, `by_subtype_percent`, `confusion` and
    the calibration. Raises: InputError for a run that is not finished, or a model that does not fit its images.
    """
    trained = model if isinstance(model, runs.Trained) else zoo.opened(model)[0]
    config, index = _opened(run)
    settings = config["recognition"]["evaluation"]
    machine = Machine.here(inference.evaluation(settings)[2])
    pairs = folds(trained.protocol, "test")
    samples = Source.of_run(index, trained.size).samples(trained.scheme.columns, pairs, trained.size)
    return {"protocol": trained.protocol, **scores(samples.facts, runs.answers(trained, samples, settings, machine))}


def _opened(run: str | Path) -> tuple[dict, Path]:
    """The configuration of a finished run, and the path of its index."""
    folder = Path(run)
    config, index = folder / "config.yaml", folder / "shards/index.json"
    if not (config.is_file() and index.is_file()):
        raise InputError(f"{folder}: has no config.yaml or no shards/index.json, expected the folder of a finished run")
    return located(load_yaml(config)), index
