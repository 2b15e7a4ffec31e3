"""Accuracy by number of looks at a track, and how many looks it takes to a right answer that stays.

    python studies/tracks/study.py [--out studies/tracks/results]

Trains the default's recipe in both protocols on the run `tracks`, and combines the class probabilities of the looks of
each test track:
    vote         most looks name the class; of classes with as many, that of the greater mean probability
    mean log     greatest mean of the logarithms of probabilities
    recurrent    a GRU on the logarithms, trained on the validation tracks
accuracy.csv: by protocol, SNR, method and number of looks, the share of right answers, with its 95 % interval over
tracks, of unseen subtypes over subtypes. Answers to k looks are those to all runs of k looks that do not overlap.
settled.csv: from the first look on, how many looks it takes until the running answer is right and stays right to the
last look: the median over tracks, and the share of tracks where it never does. tracks.png shows both.
"""

import argparse
from functools import partial
from pathlib import Path

import matplotlib
import numpy as np
import torch
from torch import nn

import trainings
from lowalt.config.command import run
from lowalt.files.csv_tables import write_csv
from lowalt.numerics.streams import stream
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.intervals import bootstrap
from lowalt.recognition.predictions import Predictions
from lowalt.recognition.schemes import PROTOCOLS, TABLE, named

matplotlib.use("Agg")
from matplotlib import pyplot as plt

LOOKS = (1, 2, 4, 8, 16, 30)
METHODS = ("vote", "mean log", "recurrent")
DATA = Path("results/tracks")
HERE = Path(__file__).parent


def sequences(found: Predictions, looks: int, snr_db: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return logarithms of probabilities (tracks, looks, classes) at an SNR, and labels and subtypes (tracks,)."""
    rows = found.take(np.flatnonzero(found.snr_db == snr_db))
    rows = rows.take(np.lexsort((rows.model, rows.subtype)))
    logs = np.log(np.maximum(rows.probabilities, 1e-6)).reshape(-1, looks, rows.probabilities.shape[1])
    return logs, rows.label[::looks], rows.subtype[::looks]


class Recurrent(nn.Module):
    """A GRU on the looks' logarithms of probabilities, which answers after each look."""

    def __init__(self, classes: int, width: int = 16) -> None:
        """classes, width: of the input and of the state."""
        super().__init__()
        self.unit, self.out = nn.GRU(classes, width, batch_first=True), nn.Linear(width, classes)

    def forward(self, logs: torch.Tensor) -> torch.Tensor:
        """Logarithms (tracks, looks, classes) -> answers (tracks, looks, classes)."""
        return self.out(self.unit(logs)[0])


def recurrent(logs: np.ndarray, label: np.ndarray, steps: int = 400) -> Recurrent:
    """Return a recurrent head, trained on all looks of tracks that it begins anywhere; arguments as of `sequences`."""
    torch.manual_seed(0)
    model, rng = Recurrent(logs.shape[-1]), np.random.default_rng(0)
    inputs, wanted = torch.tensor(logs, dtype=torch.float32), torch.tensor(label)
    optimiser = torch.optim.AdamW(model.parameters(), 1e-2, weight_decay=1e-2)
    for _ in range(steps):
        answers = model(inputs[:, rng.integers(logs.shape[1]) :])
        loss = nn.functional.cross_entropy(answers.flatten(0, 1), wanted.repeat_interleave(answers.shape[1]))
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    return model.eval()


def answers(logs: np.ndarray, method: str, head: Recurrent) -> np.ndarray:
    """Return the running answers (tracks, looks) to the looks (tracks, looks, classes) so far."""
    if method == "recurrent":
        with torch.no_grad():
            return head(torch.tensor(logs, dtype=torch.float32)).argmax(-1).numpy()
    counts = np.arange(1, logs.shape[1] + 1)[:, None]
    if method == "mean log":
        return (logs.cumsum(1) / counts).argmax(-1)
    votes = np.eye(logs.shape[-1])[logs.argmax(-1)].cumsum(1)
    # A mean probability is below one vote.
    return (votes + 0.999 * np.exp(logs).cumsum(1) / counts).argmax(-1)


def right_after(logs: np.ndarray, label: np.ndarray, count: int, method: str, head: Recurrent) -> np.ndarray:
    """Return the share of right answers (tracks,) to runs of `count` looks that do not overlap."""
    runs = logs.shape[1] // count
    cut = logs[:, : runs * count].reshape(-1, count, logs.shape[-1])
    return (answers(cut, method, head)[:, -1].reshape(-1, runs) == label[:, None]).mean(1)


def settled(right: np.ndarray) -> np.ndarray:
    """Return the looks after which a running answer (tracks, looks) stays right, inf where the last one is wrong."""
    wrong = right.shape[1] - np.argmax(~right[:, ::-1], axis=1)
    return np.where(right.all(1), 1.0, np.where(right[:, -1], wrong + 1.0, np.inf))


def tables(found: Evaluated, looks: int, seed: int) -> tuple[list[list], list[list], dict[float, np.ndarray]]:
    """Return the rows of both tables, and the looks until each track's answer by mean log stays right, by SNR (dB)."""
    snrs = sorted(set(found.test.snr_db.tolist()))
    known = [sequences(found.part("validation"), looks, snr) for snr in snrs]
    head = recurrent(*(np.concatenate(part) for part in list(zip(*known, strict=True))[:2]))
    shares, times, curves = [], [], {}
    for snr in snrs:
        logs, label, subtype = sequences(found.test, looks, snr)
        clusters = subtype if found.protocol == "unseen" else np.arange(len(label))
        for method in METHODS:
            for count in LOOKS:
                values = right_after(logs, label, count, method, head)
                interval = bootstrap(clusters, values, stream(seed, "tracks", found.protocol, method, snr, count))
                shares.append([found.protocol, f"{snr:g}", method, count, *(f"{100 * one:.2f}" for one in interval),
                               len(label)])  # fmt: skip
            after = settled(answers(logs, method, head) == label[:, None])
            shown = (f"{one:g}" for one in np.quantile(after, (0.5, 0.9), method="inverted_cdf"))
            times.append([found.protocol, f"{snr:g}", method, *shown, f"{100 * np.isinf(after).mean():.2f}"])
            if method == "mean log":
                curves[snr] = after
    return shares, times, curves


def picture(path: Path, shares: list[list], curves: dict[str, dict[float, np.ndarray]]) -> None:
    """Draw accuracy over looks, one panel per protocol and SNR, and the share of tracks whose answer is settled."""
    snrs = list(next(iter(curves.values())))
    figure, panels = plt.subplots(len(curves), len(snrs) + 1, figsize=(13, 3.1 * len(curves)), layout="constrained")
    for line, (protocol, settled_after) in zip(panels, curves.items(), strict=True):
        for panel, snr in zip(line, snrs, strict=False):
            for number, method in enumerate(METHODS):
                rows = [row for row in shares if row[:3] == [protocol, f"{snr:g}", method]]
                count, value, low, high = np.array([row[3:7] for row in rows], float).T
                panel.plot(count, value, marker="o", markersize=3, label=method, color=f"C{number}")
                panel.fill_between(count, low, high, alpha=0.12, color=f"C{number}", linewidth=0)
            panel.set(xscale="log", xticks=LOOKS, xticklabels=LOOKS, title=f"{protocol}, {snr:g} dB", xlabel="looks",
                      ylim=(min(float(row[5]) for row in shares) - 2, 101))  # fmt: skip
            panel.minorticks_off()
            panel.grid(alpha=0.3)
        line[0].set_ylabel("right answers (%)")
        for number, (snr, after) in enumerate(settled_after.items()):
            share = [100 * np.mean(after <= count) for count in range(1, LOOKS[-1] + 1)]
            line[-1].step(range(1, LOOKS[-1] + 1), share, where="post", color=f"C{number + 3}", label=f"{snr:g} dB")
        line[-1].set(title=f"{protocol}, mean log: settled", xlabel="looks", ylabel="tracks right to the end (%)",
                     ylim=(0, 101))  # fmt: skip
        line[-1].grid(alpha=0.3)
    panels[0, 0].legend(fontsize=8, loc="lower right")
    panels[0, -1].legend(fontsize=8, loc="lower right")
    figure.savefig(path, dpi=110)


def main(arguments: list[str]) -> None:
    """Train in both protocols and write the tables and the picture."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    line.add_argument("--out", default=HERE / "results", type=Path, help="folder of the tables and the picture")
    given = line.parse_args(arguments)
    config = trainings.config_of(HERE / "config.yaml")
    looks, size = config["motion"]["looks"], config["recognition"]["size"]
    scheme = named(TABLE, "A:VRP+TRP+VT", list(config["network"]["stations"]))
    source = lambda chosen, pairs, part: trainings.images_of(DATA, chosen, pairs, size)  # noqa: E731
    call = partial(trainings.trained, config=config, data=DATA, out=DATA, source=source)
    shares, times, curves = [], [], {}
    for protocol in PROTOCOLS:
        found = Evaluated(call(trainings.Job(scheme, protocol, 0)))
        more_shares, more_times, curves[protocol] = tables(found, looks, config["seed"])
        shares += more_shares
        times += more_times
    first = ["protocol", "snr_db", "method"]
    columns = [*first, "looks", "accuracy_percent", "low", "high", "tracks"]
    write_csv(given.out / "accuracy.csv", columns, shares)
    write_csv(given.out / "settled.csv", [*first, "median_looks", "looks_90_percent", "never_percent"], times)
    picture(given.out / "tracks.png", shares, curves)
    print(f"{given.out}: written")


if __name__ == "__main__":
    run(main)
