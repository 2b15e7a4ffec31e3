"""The core's commands of `lowalt`: the module of each, what it does in one line, and an example.

Only the module of the given command is imported, so `lowalt --help` imports none.
"""

from typing import NamedTuple


class Command(NamedTuple):
    """One command: its module, which offers `add_to(commands, name)`, its help, an example."""

    module: str
    meaning: str
    example: str


_INDEX = "results/default/shards/index.json"
CORE_COMMANDS = {
    "run": Command(
        "lowalt.commands.workflow",
        "run the workflow: the default, or with overlays",
        "lowalt run config/tiny.yaml --target data --cores 2",
    ),
    "status": Command(
        "lowalt.commands.workflow",
        "the state of a run in another terminal",
        "lowalt status",
    ),
    "sample": Command(
        "lowalt.commands.sample",
        "one sample: tile, signals, record, and a picture with axes",
        "lowalt sample Crow 3 --snr 13 --out samples",
    ),
    "predict": Command(
        "lowalt.commands.predict",
        "class probabilities of a tile, of signals or of a recording by a trained model",
        "lowalt predict default-seen sample.npy",
    ),
    "explain": Command(
        "lowalt.commands.explain",
        "say whether a scene's receiver finds its targets, and what each effect changes",
        "lowalt explain config/scenes/urban.yaml --suggest 1e-3 --out mine.yaml",
    ),
    "spectra": Command(
        "lowalt.commands.spectra",
        "the spectra of a configuration, and the time an image of each takes",
        "lowalt spectra config/tiny.yaml",
    ),
    "verify": Command(
        "lowalt.commands.data",
        "check every byte of a data set",
        f"lowalt verify {_INDEX}",
    ),
    "remake": Command(
        "lowalt.commands.data",
        "make stored samples again from their records and compare every byte",
        f"lowalt remake {_INDEX} crow-000003-snr013",
    ),
    "compare": Command(
        "lowalt.commands.compare",
        "two finished runs: what differs in configuration, accuracy, time and bytes",
        "lowalt compare results/default results/tiny",
    ),
    "report": Command(
        "lowalt.commands.report",
        "make the page of one run again, or a page that links all runs and compares any two",
        "lowalt report results/default, or lowalt report --gallery",
    ),
    "completion": Command(
        "lowalt.commands.completion",
        "print the completion of commands, options and files for bash and zsh",
        "source <(lowalt completion)",
    ),
}
