"""The commands of `lowalt`: the module of each, what it does in one line, and an example.

Only the module of the given command is imported, so `lowalt --help` imports none.
"""

from typing import NamedTuple


class Entry(NamedTuple):
    """One command: its module in this folder, its line of help, and an example."""

    module: str
    meaning: str
    example: str


_INDEX = "results/default/shards/index.json"
COMMANDS = {
    "run": Entry("workflow", "run the workflow: the default, or with overlays",
                 "lowalt run config/tiny.yaml --target data --cores 2"),
    "status": Entry("workflow", "the state of a run in another terminal", "lowalt status"),
    "sample": Entry("sample", "one sample: tile, signals, record, and a picture with axes",
                    "lowalt sample Crow 3 --snr 13 --out samples"),
    "predict": Entry("predict", "class probabilities of a tile, of signals or of a recording by a trained model",
                     "lowalt predict default-seen sample.npy"),
    "explain": Entry("explain", "say whether a scene's receiver finds its targets, and what each effect changes",
                     "lowalt explain config/scenes/urban.yaml --suggest 1e-3 --out mine.yaml"),
    "target": Entry("target", "your own mesh or robot: look, draft a record, make its cloud",
                    "lowalt target inspect inputs/mydrone.stl"),
    "recording": Entry("recording", "a recording of your own radar: look, draft its record, train a recogniser",
                       "lowalt recording inspect walk.bin --carrier 24e9 --rate 12000"),
    "spectra": Entry("spectra", "the spectra of a configuration, and the time an image of each takes",
                     "lowalt spectra config/tiny.yaml"),
    "verify": Entry("data", "check every byte of a data set", f"lowalt verify {_INDEX}"),
    "remake": Entry("data", "make stored samples again from their records and compare every byte",
                    f"lowalt remake {_INDEX} crow-000003-snr013"),
    "benchmark": Entry("benchmark", "lowalt-40: data, tracks, scores of submissions, table of baselines",
                       "lowalt benchmark score predictions.csv --track unseen"),
    "compare": Entry("compare", "two finished runs: what differs in configuration, accuracy, time and bytes",
                     "lowalt compare results/default results/tiny"),
    "report": Entry("report", "make the page of one run again, or a page that links all runs and compares any two",
                    "lowalt report results/default, or lowalt report --gallery"),
    "completion": Entry("completion", "print the completion of commands, options and files for bash and zsh",
                        "source <(lowalt completion)"),
}  # fmt: skip
