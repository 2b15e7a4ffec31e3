"""The card of a trained model: Markdown with the block of metadata that hubs read.

It is written next to every model file.

It holds the training's record, the run's table of accuracy, and how 8-bit weights change the
answers.
"""

from pathlib import Path

import yaml

from lowalt import __version__
from lowalt.files.atomic import write_file
from lowalt.files.csv_tables import read_csv
from lowalt.recognition.model_file import EIGHT, ModelFile, run_folder
from lowalt.recognition.schemes import SPECTRA
from lowalt.shards.hub import TAGS, markdown_table

RUN = {
    "train_samples": "training samples",
    "steps": "steps",
    "batch": "batch",
    "samples_seen": "samples seen",
    "parameters": "trained values",
    "validation_accuracy": "accuracy on the validation fold when training ended",
    "hardware": "hardware",
    "train_s": "training, s",
    "precision": "arithmetic of the training",
    "torch": "torch",
    "timm": "timm",
}
"""Entries of run.json that a card shows, and their words."""
MEANING = {
    "seen": "trained and tested on the same subtypes, with different motion models",
    "unseen": "tested on subtypes that no training sample shows",
}
USE = """\
    lowalt predict {name}.safetensors sample.npy

`sample.npy` holds the signals of one sample, (stations, symbols) complex; a tile (.png) does as well. The file's
metadata, the entry `lowalt`, holds everything that determined the weights, and how signals become images.
"""
LIMITS = """\
- It has seen simulated echoes only, of the network and the effects that its run was configured with.
- One target a sample, tracked perfectly. It always answers with one of its classes, also for noise alone.
- Accuracy on subtypes that it was not trained on is lower: compare the tables of both protocols.
"""
RADAR_ACCURACY = (
    "It classifies {percent:.1f} % of {windows} simulated windows correctly that no training saw.\n"
)
RADAR_USE = """\
    lowalt predict {name} recording.yaml

`recording.yaml` names the file of samples and says what they do not hold: docs/tutorials/recording.md.
"""
RADAR_LIMITS = """\
- It has seen simulated echoes of few kinds of targets only, and never a recording.
- A window that holds a line above the recording's noise gets one of its classes, whatever the line is of.
"""


def accuracy_rows(model: str | Path, protocol: str, scheme: str) -> list[dict[str, str]]:
    """Return the rows of the run's accuracy.csv for a model; none without such a table."""
    folder = run_folder(model)
    if folder is None or not (folder / "accuracy.csv").is_file():
        return []
    rows = read_csv(
        folder / "accuracy.csv",
        "protocol",
        "scheme",
        "snr_db",
        "accuracy_percent",
        "samples",
        "seeds",
    )
    return [row for row in rows if (row["protocol"], row["scheme"]) == (protocol, scheme)]


def _shown(value: object) -> str:
    """A value of a record as text of a card."""
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)


def _accuracy(rows: list[dict[str, str]]) -> str:
    """The section on accuracy on the test fold."""
    if not rows:
        return "The run had no table of accuracy when this card was written.\n"
    seeds = rows[0]["seeds"]
    whose = f"mean over the {seeds} trainings of the run, of which this is one"
    if seeds == "1":
        whose = "of this model"
    cells = []
    for row in rows:
        level = "all" if row["snr_db"] == "avg" else row["snr_db"]
        cells.append((level, row["accuracy_percent"], row["samples"]))
    return (
        f"From the run's accuracy.csv: accuracy {whose}, with weights as trained, on the test fold "
        "of the protocol, evaluated as the run's\nconfiguration says (there, answers may be means "
        "over a sample and its mirror image; `lowalt predict` takes no such mean).\n\n"
        + markdown_table(("SNR (dB)", "accuracy (%)", "test samples"), cells)
    )


def _rounded(measured: dict) -> str:
    """The section on 8-bit weights."""
    accuracies = [
        ("as trained", f"{measured['exact_percent']:.3f}"),
        ("8 bits", f"{measured['percent']:.3f}"),
    ]
    return (
        "## Weights in 8 bits\n\n"
        "Matrices are whole numbers of 8 bits with one scale per row; everything else is float32. "
        f"Both sets of weights answered\nall {measured['samples']} samples of the validation "
        "fold, in float32:\n\n"
        + markdown_table(("weights", "accuracy (%)"), accuracies)
        + f"\n{measured['changed']} answers differ; the largest change of a probability is "
        f"{measured['largest_change']:.4f}.\n"
    )


def _facts(content: ModelFile) -> list[tuple[str, object]]:
    """The rows of the section on training."""
    state = content.model
    scheme = state["scheme"]
    method = scheme.get("method") or scheme.get("backbone") or state["network"].get("backbone", "")
    spectra = "+".join(SPECTRA[number] for number in scheme["spectra"])
    sees = "the slow-time signals"
    if spectra:
        sees = f"{spectra}, {state['size']} x {state['size']} pixels each"
    facts = [
        ("classes", ", ".join(state["classes"])),
        ("scheme", scheme["name"]),
        ("protocol", state["protocol"]),
        ("network", f"{method}, fusion {scheme['fusion']}"),
        ("sees", sees),
        ("seed", state["seed"]),
    ]
    if "start" in state:
        facts.append(("started from the weights of", state["start"]["training"]))
    for key, words in RUN.items():
        if key in content.run:
            facts.append((words, _shown(content.run[key])))
    for fold, digest in sorted(content.identity.get("samples", {}).items()):
        facts.append((f"SHA-256 of the {fold} samples", f"`{digest}`"))
    return facts


def card(content: ModelFile, accuracy: list[dict[str, str]], name: str) -> str:
    """Return the card of a model.

    accuracy: rows of the run's table (`accuracy_rows`); name: of the model's file.
    """
    state = content.model
    front = {
        "license": "mit",
        "library_name": "lowalt",
        "tags": [*(tag for tag in TAGS if tag != "webdataset"), "safetensors"],
    }
    if "radar" in content.input:
        radar = content.input["radar"]
        use = RADAR_USE
        measured = "Not stated.\n"
        if content.input.get("expected"):
            measured = RADAR_ACCURACY.format(**content.input["expected"])
        limits = RADAR_LIMITS
        caution = content.input.get("caution", "")
        if caution:
            limits += f"- {caution[0].upper()}{caution[1:]}.\n"
        where = (
            f"a radar of {radar['carrier_hz'] / 1e9:g} GHz with a\n{radar['channel']} channel, "
            "trained on its twin"
        )
    else:
        where = "base stations, trained"
        measured = _accuracy(accuracy)
        use = USE
        limits = LIMITS
    sections = [
        f"---\n{yaml.safe_dump(front, sort_keys=False)}---\n\n# {name}\n",
        (
            f"A network that tells {', '.join(state['classes'])} apart by their echoes at {where}"
            f" by lowalt {__version__}.\nProtocol {state['protocol']}:"
            f" {MEANING.get(state['protocol'], 'of the user')}.\n"
        ),
        "## Training\n",
        markdown_table(("entry", "value"), _facts(content)),
        "## Accuracy\n",
        measured,
    ]
    if content.weights == EIGHT and content.measured:
        sections.append(_rounded(content.measured))
    sections += [f"## Use\n\n{use.format(name=name)}", f"## Limits\n\n{limits}"]
    return "\n".join(sections)


def write(out: str | Path, content: ModelFile, accuracy: list[dict[str, str]]) -> Path:
    """Write the card next to the model file `out`, as .md, and return its path."""
    path = Path(out).with_suffix(".md")
    write_file(path, card(content, accuracy, path.stem))
    return path
