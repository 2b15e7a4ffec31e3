"""Time of each effect and its influence on signals, spectra and recognition, alone and together: the table of a run.

    python -m lowalt.measure.effects_cost --settings JSON --samples seen-none.npz unseen-none.npz ...
        --model model.pt --out effects.csv

Settings: seed, and evaluation of the configuration's recognition block. The files are those of
`lowalt.measure.effects_samples`, any number a call; the accuracies of all others are compared with those of the call
without effects.
"""

import sys
from pathlib import Path

import numpy as np

from lowalt.common.command import name_backbone, parser, pick, run
from lowalt.common.csv_tables import short, write_csv
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.measure.effects_samples import read_samples
from lowalt.recognition.intervals import paired_difference
from lowalt.scene.catalogue import PLACES

COLUMNS = (
    "call", "effects", "motion_models", "base_ms", "added_ms", "parts_ms", "signal_change", "pixels_changed_percent",
    "pixel_difference", "cells_changed_percent", "snr_db", "samples", "accuracy_without_percent",
    "accuracy_with_percent", "difference_points", "low", "high", "scheme", "protocol", "hardware",
)  # fmt: skip
"""One row a call: an effect alone with its defaults, a scene's effects together, or none.

base_ms, added_ms: processor time a sample and station, medians of each subtype's, averaged; parts_ms: sum of the added
times that a scene's effects have alone; signal_change: root mean square of Y_bin's change over Y_bin's, averaged;
pixels_changed_percent: of all spectra's pixels, by more than 8 of 255, without noise; pixel_difference: mean absolute
change, of 255; cells_changed_percent: OFDM symbols whose range cell is another; snr_db: the SNRs of the network's
samples, separated by blanks; difference_points: accuracy with less accuracy without, on the same samples and noise, and
its 95 % interval, which resamples whole motion models.
"""
NONE = "none"
"""Name of the call for no effects."""


def gathered(files: list[tuple[dict, dict]]) -> list[tuple[dict, dict]]:
    """Return one (header, arrays) a call from those of its files, joined; in the chain's order, scenes last.

    Raises: InputError naming the call whose files differ in effects or SNRs.
    """
    parts: dict[str, list[tuple[dict, dict]]] = {}
    for header, arrays in files:
        parts.setdefault(header["name"], []).append((header, arrays))
    result = []
    for name, mine in parts.items():
        header, first = mine[0]
        if any(h["effects"] != header["effects"] or a["snr_db"].tolist() != first["snr_db"].tolist() for h, a in mine):
            raise InputError(f"{name}: files of other effects or SNRs than the first's, expected the same")
        once = ("snr_db", "spectra", "example", "example_subtype")
        result.append((header, {
            key: value if key in once else np.concatenate([arrays[key] for _, arrays in mine])
            for key, value in first.items()
        }))  # fmt: skip
    order = [NONE, *PLACES]
    return sorted(result, key=lambda call: order.index(call[0]["name"]) if call[0]["name"] in order else len(order))


def correct(probabilities: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return whether the most probable class is the true one; probabilities (K, S, classes), labels (K,) -> (K, S)."""
    return probabilities.argmax(axis=-1) == labels[:, None]


def difference(
    without: np.ndarray, with_it: np.ndarray, motion: np.ndarray, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Return accuracy with less accuracy without in percentage points, and the ends of its 95 % interval.

    without, with_it: (K, S) bool, the same samples; motion: (K,) names of motion models, which are resampled whole.
    Source: as `lowalt.recognition.intervals.bootstrap`.
    """
    found = paired_difference(np.repeat(motion, without.shape[1]), with_it.ravel(), without.ravel(), rng)
    return tuple(100 * value for value in found)


def typical_ms(times: np.ndarray, subtype: np.ndarray) -> float:
    """Return the mean over subtypes of each one's median time; times (K, stations), subtype (K,) names.

    The time of a data set follows from a mean; the medians keep the machine's interruptions out of it.
    """
    return float(np.mean([np.median(times[subtype == name]) for name in np.unique(subtype)]))


def same_samples(base: dict[str, np.ndarray], other: dict[str, np.ndarray], name: str) -> list[int]:
    """Return the places of other's SNRs among the base's.

    Raises: InputError naming the call whose samples are others than the base's, or that has an SNR of its own.
    """
    if any(not np.array_equal(base[key], other[key]) for key in ("subtype", "model", "label")):
        raise InputError(f"{name}: its motion models are not those of {NONE!r}, expected the same")
    known = base["snr_db"].tolist()
    if not set(other["snr_db"].tolist()) <= set(known):
        raise InputError(f"{name}: SNRs {other['snr_db'].tolist()}, expected some of {known}")
    return [known.index(snr) for snr in other["snr_db"].tolist()]


def rows(calls: list[tuple[dict, dict]], right: dict[str, np.ndarray], network: dict, seed: int) -> list[dict]:
    """Return a row (keys COLUMNS) for every call, none first, then in the order given (that of `gathered`).

    calls: (header, arrays) of each; right: (K, S) bool of each by name; network: {scheme, protocol} of the network.
    Raises: InputError where there is no call without effects, or the samples differ.
    """
    named = {header["name"]: (header, arrays) for header, arrays in calls}
    if NONE not in named:
        raise InputError(f"--samples: {sorted(named)}, expected {NONE!r} among them")
    base = named[NONE][1]
    motion = np.array([f"{s}/{m}" for s, m in zip(base["subtype"], base["model"], strict=True)])
    added = {
        name: typical_ms(arrays["total_ms"] - arrays["base_ms"], arrays["subtype"])
        for name, (_, arrays) in named.items()
    }
    result = []
    for name in sorted(named, key=lambda name: name != NONE):
        header, arrays = named[name]
        places = same_samples(base, arrays, name)
        without, with_it = right[NONE][:, places], right[name]
        value, low, high = difference(without, with_it, motion, stream(seed, "bootstrap", "effects", name))
        parts = [added[part] for part in header["effects"] if part in added] if len(header["effects"]) > 1 else []
        # Leave the cell empty unless every effect of the scene was also measured alone.
        whole = len(parts) == len(header["effects"])
        result.append({
            "call": name, "effects": " ".join(header["effects"]), "motion_models": len(motion),
            "base_ms": typical_ms(arrays["base_ms"], arrays["subtype"]), "added_ms": added[name],
            "parts_ms": sum(parts) if parts and whole else "",
            "signal_change": float(arrays["signal_change"].mean()),
            "pixels_changed_percent": 100 * float(arrays["pixels_changed"].mean()),
            "pixel_difference": float(arrays["pixel_difference"].mean()),
            "cells_changed_percent": 100 * float(arrays["cells_changed"].mean()),
            "snr_db": " ".join(f"{snr:g}" for snr in arrays["snr_db"]), "samples": with_it.size,
            "accuracy_without_percent": 100 * float(without.mean()),
            "accuracy_with_percent": 100 * float(with_it.mean()),
            "difference_points": value, "low": low, "high": high, **network, "hardware": header["hardware"],
        })  # fmt: skip
    return result


def write(path: str | Path, table: list[dict]) -> None:
    """Write the rows as CSV, numbers to six digits."""
    write_csv(path, COLUMNS, [{key: short(value) for key, value in row.items()} for row in table])


class _Held:
    """Images in memory as `inference.probabilities` asks for them: those of every motion model at every SNR."""

    def __init__(self, views: np.ndarray, columns: list[int]):
        """views: (K, S, V, size, size) uint8; columns: the network's views among the V."""
        self.images = views.reshape(-1, *views.shape[2:])[:, columns]

    def inputs(self, numbers: np.ndarray) -> np.ndarray:
        """Return the images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        return self.images[numbers]


def recognised(
    model: str, calls: list[tuple[dict, dict]], block: dict, own: str = ""
) -> tuple[dict[str, np.ndarray], dict]:
    """Return which samples of each call a trained model recognises, (K, S) bool by name, and {scheme, protocol}.

    model: model.pt; block: recognition.evaluation; own: as in `runs.of_state`.

    Raises: InputError where the images are not of the model's size.
    """
    from lowalt.recognition import recipe, runs
    from lowalt.recognition.inference import Machine, evaluation, probabilities
    from lowalt.recognition.schemes import columns_in

    batch, threads, precision, mirror, _ = evaluation(block)
    trained = runs.load(model, own)
    recipe.seeded(trained.seed, ("evaluate",), threads)
    machine = Machine.here(precision)
    network = trained.model.to(machine.device)
    found = {}
    for header, arrays in calls:
        if arrays["views"].shape[-1] != trained.size:
            raise InputError(f"{header['name']}: images of {arrays['views'].shape[-1]} pixels, {model} {trained.size}")
        count = arrays["views"].shape[0] * arrays["views"].shape[1]
        names = arrays["spectra"].tolist()
        stations = arrays["views"].shape[2] // len(names)
        held = _Held(arrays["views"], columns_in(trained.scheme.columns, names, stations, header["name"]))
        told = probabilities(network, held, np.arange(count), machine, batch, mirror)
        found[header["name"]] = correct(told.reshape(*arrays["views"].shape[:2], -1), arrays["label"])
    return found, {"scheme": trained.scheme.name, "protocol": trained.protocol}


def main(arguments: list[str]) -> None:
    """Ask the trained network, and write the table."""
    options = parser("lowalt.measure.effects_cost", __doc__.splitlines()[0])
    options.add_argument("--samples", nargs="+", required=True, help="files of lowalt.measure.effects_samples")
    options.add_argument("--model", required=True, help="model.pt of a network trained without effects")
    name_backbone(options)
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    seed, evaluation = pick(given.settings, "seed", "evaluation")
    calls = gathered([read_samples(path) for path in given.samples])
    right, network = recognised(given.model, calls, evaluation, given.backbone)
    table = rows(calls, right, network, seed)
    write(given.out, table)
    print(f"{given.out}: {len(table)} calls, {len(calls[0][1]['label'])} motion models", file=sys.stderr)


if __name__ == "__main__":
    run(main)
