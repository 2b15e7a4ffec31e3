"""Training and evaluation on the data set of a finished run, in one call each."""

from dataclasses import replace
from pathlib import Path

from lowalt.config.layers import SCHEMA, check, of_run
from lowalt.config.named_code import allowed
from lowalt.config.network import station_names
from lowalt.files.errors import InputError
from lowalt.files.shipped import located, shipped
from lowalt.recognition import inference, runs, zoo
from lowalt.recognition.inference import Machine
from lowalt.recognition.protocols import folds
from lowalt.recognition.sample_sources import Source
from lowalt.recognition.schemes import named
from lowalt.recognition.score import scores
from lowalt.shards import ShardSet


def train(
    run: str | Path, scheme: str = "ABC:VRP+TRP+VT", protocol: str = "unseen", seed: int = 0,
    out: str | Path = "model", backbone: str = "", **training: object,
) -> runs.Trained:  # fmt: skip
    """Train a scheme on the data set of a finished run and return the model, which stays in `out`/model.pt.

    run: its folder, such as results/default; scheme: a name of config/schemes.csv; protocol: "unseen" trains on twenty
    subtypes and tests on the others, "seen" trains and tests on other motion of all; backbone: FILE.py:FUNCTION of your
    own, which a run's folder may not choose; training: settings that replace the run's own, such as steps=500. A
    training that was interrupted goes on.
    Raises: InputError for a run that is not finished or names code, or a wrong name or setting.
    """
    config, index = _opened(run)
    block = config["recognition"]
    chosen = named(block["table"], scheme, station_names(config["network"]))
    name = backbone or allowed(chosen.backbone_of(block["network"]), "", run)
    network = {**block["network"], "backbone": name}
    settings = chosen.settled({
        "size": block["size"], "augmentation": block["augmentation"], "network": network, "seed": seed,
        "training": {**block["training"], **training}, "colour_map": config["images"]["colour_map"],
        "classes": list(ShardSet(index).classes),
    })  # fmt: skip
    samples = Source.of_run(index, settings["size"]).for_training(chosen, protocol, settings["size"])
    runs.train(samples, replace(chosen, backbone=chosen.backbone and name), protocol, settings, Path(out))
    return runs.load(Path(out) / "model.pt", backbone)


def evaluate(model: runs.Trained | str | Path, run: str | Path, backbone: str = "") -> dict:
    """Return how a trained model does on the test samples of its protocol in the data set of a finished run.

    model: of `train`, a file (model.pt or .safetensors), or a name of the zoo; run: a folder such as results/default;
    backbone: the FILE.py:FUNCTION of a model file that names code.
    The result has `accuracy_percent`, the mean over the SNRs, `by_snr_percent`, `by_subtype_percent`, `confusion` and
    the calibration. Raises: InputError for a run that is not finished, or a model that does not fit its images.
    """
    trained = model if isinstance(model, runs.Trained) else zoo.opened(model, trusted=backbone)[0]
    config, index = _opened(run)
    settings = config["recognition"]["evaluation"]
    machine = Machine.here(inference.evaluation(settings)[2])
    pairs = folds(trained.protocol, "test")
    samples = Source.of_run(index, trained.size).samples(trained.scheme.columns, pairs, trained.size)
    return {"protocol": trained.protocol, **scores(samples.facts, runs.answers(trained, samples, settings, machine))}


def _opened(run: str | Path) -> tuple[dict, Path]:
    """The configuration of a finished run, and the path of its index."""
    folder = Path(run)
    index = folder / "shards/index.json"
    if not index.is_file():
        raise InputError(f"{folder}: has no shards/index.json, expected the folder of a finished run")
    try:
        return located(check(of_run(folder), shipped(SCHEMA))), index
    except InputError as error:
        raise InputError(str(error) if str(folder) in str(error) else f"{folder / 'config.yaml'}: {error}") from None
