"""Tables (CSV) from prediction files: the paper's and further ones. Nothing is tuned on test data.

The first columns of each file are `protocol, scheme`:
    accuracy.csv     snr_db ("avg": mean over the SNRs), accuracy_percent, macro F1 in percent with
                     its 95 % interval, samples, hardware; averages over several seeds; seeds is
                     their number, spread_points their standard deviation (empty for one)
    seen_test.csv    the same for the seen subtypes' test fold in the unseen protocol
    seeds.csv        one row per training: accuracy_percent on average over the SNRs, its network,
                     cost and hardware
    confusion.csv    category, predicted, samples
    confusion_by_snr.csv
                     snr_db, category, predicted, samples
    subtypes.csv     category, subtype, accuracy_percent, samples
    ranges.csv       band of the distance to the nearest station used, accuracy_percent, samples
    aspects.csv      band of the aspect seen from that station, accuracy_percent, samples
    alarms.csv       required detection of the first class, its threshold (set on validation), and
                     on test the detection and the false alarms of the other classes with 95 %
                     intervals. Each model has its own threshold; values are means over the seeds.
                     "not measurable" where fewer than ten validation samples would be below the
                     threshold
    calibration.csv  calibration error, Brier score, cross entropy on test, means over the seeds
    comparisons.csv  over: the scheme compared with; difference with its 95 % interval, and what
                     the interval resamples: training seeds (where there are several), subtypes
                     (unseen protocol), motion models
    orderings.csv    the paper's claims: its own difference, ours, and whether its ordering holds
                     here (the interval lies above zero), is reversed (below), undecided (zero
                     inside) or not ranked (fewer than 3 seeds)
"""

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from lowalt.config.classes import word
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition import statistics
from lowalt.recognition.evaluated import Evaluated, difference, whole_subtypes
from lowalt.recognition.paper_claims import CLAIMS, ordering_rows
from lowalt.recognition.predictions import Predictions

F1 = ("macro_f1_percent", "macro_f1_low", "macro_f1_high")
"""Columns of accuracy.csv with macro F1 and the bounds of its 95 % interval."""
ACCURACY = (
    "snr_db",
    "accuracy_percent",
    *F1,
    "samples",
    "hardware",
    "seeds",
    "spread_points",
)
"""Columns of accuracy.csv behind protocol and scheme."""
TRAINING = (
    "backbone",
    "weights",
    "parameters",
    "steps",
    "samples_seen",
    "train_s",
    "train_processor_s",
    "samples_per_s",
    "precision",
    "ranks",
)
"""Columns that seeds.csv repeats from a training's record."""
DETECTIONS = (0.9, 0.95, 0.99)
"""Required detection rates of the first class, for each of which a threshold is set."""


def percent(share: float) -> str:
    """Return a share in percent, with four digits."""
    return f"{100 * share:.4f}"


def snr_text(snr_db: float) -> str:
    """Return an SNR as the tables write it: "3", "2.5", "inf"."""
    return f"{snr_db:g}"


def accuracy_rows(runs: list[Evaluated], part: str, seed: int) -> Iterable[list]:
    """Yield the rows of accuracy.csv of one scheme's runs.

    The columns are ACCURACY. Values are means over the runs, one per training seed; seed: of the
    bootstrap. Intervals of macro F1 resample whole subtypes if these are held out from training.
    """
    parts = [run.part(part) for run in runs]
    protocol = runs[0].protocol
    name = runs[0].scheme
    generator = stream(seed, "macro-f1", protocol, name, part)
    whole = (protocol, part) == ("unseen", "test")
    scores = {}
    f1_by_snr = statistics.f1_by_snr(parts, len(runs[0].classes), whole, generator)
    for snr, interval in f1_by_snr.items():
        name_of_snr = snr if isinstance(snr, str) else snr_text(snr)
        scores[name_of_snr] = interval
    of_runs = [statistics.accuracy_by(run.snr_db, run.correct) for run in parts]
    shares = {}
    counts = {}
    for snr, (_, count) in of_runs[0].items():
        shares[snr_text(snr)] = [of_run[snr][0] for of_run in of_runs]
        counts[snr_text(snr)] = count
    shares["avg"] = np.mean(list(shares.values()), axis=0).tolist()
    counts["avg"] = len(parts[0])
    for snr, values in shares.items():
        spread = percent(np.std(values, ddof=1)) if len(values) > 1 else ""
        f1 = map(percent, scores[snr])
        seeds = len(values)
        yield [snr, percent(np.mean(values)), *f1, counts[snr], runs[0].hardware, seeds, spread]


def seed_rows(runs: list[Evaluated]) -> Iterable[list]:
    """Yield rows [seed, accuracy_percent, *TRAINING, hardware], of the mean over the SNRs."""
    for run in runs:
        by_snr = statistics.accuracy_by(run.test.snr_db, run.test.correct)
        shares = [share for share, _ in by_snr.values()]
        known = [run.about.get(name, "") for name in TRAINING]
        yield [run.seed, percent(np.mean(shares)), *map(_six_digits, known), run.hardware]


def _six_digits(value: object) -> object:
    """A float as text with six digits, anything else as it is."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return value


def confusion_rows(runs: list[Evaluated], snr_db: float | None = None) -> Iterable[list]:
    """Yield rows [category, predicted, samples], summed over the seeds.

    snr_db: the SNR (dB) to count; None counts all.
    """
    classes = runs[0].classes
    counts = np.zeros((len(classes), len(classes)), int)
    for run in runs:
        test = run.test
        if snr_db is not None:
            test = test.take(test.snr_db == snr_db)
        counts += statistics.confusion(test.label, test.guesses, len(classes))
    for true, name in enumerate(classes):
        for guess, other in enumerate(classes):
            yield [name, other, counts[true, guess]]


def confusion_by_snr_rows(runs: list[Evaluated]) -> Iterable[list]:
    """Yield rows [snr_db, category, predicted, samples], summed over the seeds."""
    for snr in np.unique(runs[0].test.snr_db):
        yield from ([snr_text(snr), *row] for row in confusion_rows(runs, snr))


def subtype_rows(runs: list[Evaluated]) -> Iterable[list]:
    """Yield rows [category, subtype, accuracy_percent, samples], each category's worst first."""
    test = runs[0].test
    classes = runs[0].classes
    category = {
        name: classes[label] for name, label in zip(test.subtype.tolist(), test.label, strict=True)
    }
    correct = np.mean([run.test.correct for run in runs], axis=0)
    table = statistics.accuracy_by(test.subtype, correct)

    def worst_first(name: str) -> tuple:
        """By class, then by accuracy."""
        share, _ = table[name]
        return classes.index(category[name]), share, name

    for name in sorted(table, key=worst_first):
        share, count = table[name]
        yield [category[name], name, percent(share), count]


def band_rows(
    runs: list[Evaluated], values: Callable[[Predictions], np.ndarray], width: float
) -> Iterable[list]:
    """Yield rows [from, to, accuracy_percent, samples] for bands of a value.

    Samples without the value are omitted.
    """
    test = runs[0].test
    numbers = values(test)
    known = ~np.isnan(numbers)
    correct = np.mean([run.test.correct for run in runs], axis=0)
    bands = statistics.accuracy_by(np.floor(numbers[known] / width), correct[known])
    for band, (share, count) in bands.items():
        yield [f"{band * width:g}", f"{(band + 1) * width:g}", percent(share), count]


def _alarm_part(predictions: Predictions) -> statistics.AlarmPart:
    """The data of predictions for counting false alarms."""
    return statistics.AlarmPart(
        predictions.probabilities[:, statistics.LOOKED_FOR],
        predictions.label,
        predictions.motion,
        predictions.subtype,
    )


def alarm_rows(runs: list[Evaluated], seed: int) -> Iterable[list]:
    """Yield rows [asked, threshold, rate, low, high, ...] of detection and false alarms.

    Detection is that of the first class; the false alarms of the others follow.

    In percent, with 95 % intervals; thresholds come from validation samples. "not measurable" where
    there are too few validation samples to set a threshold.
    """
    classes = len(runs[0].classes)
    validations = [_alarm_part(run.part("validation")) for run in runs]
    tests = [_alarm_part(run.test) for run in runs]
    if not all((part.labels == statistics.LOOKED_FOR).any() for part in validations):
        return
    for asked in DETECTIONS:
        if not statistics.measurable(validations[0].labels, asked):
            yield [percent(asked), *["not measurable"] * (1 + 3 * classes)]
            continue
        levels = [statistics.threshold(part.scores, part.labels, asked) for part in validations]
        rates = []
        for part, level in zip(tests, levels, strict=True):
            detected, alarms = statistics.alarm_rates(part.scores, part.labels, level, classes)
            rates.append([detected, *alarms])
        generator = stream(seed, "alarms", runs[0].protocol, runs[0].scheme, asked)
        bounds = statistics.alarm_intervals(
            validations, tests, asked, whole_subtypes(runs), generator, classes
        )
        cells = []
        for rate, pair in zip(np.mean(rates, 0), bounds, strict=True):
            cells += [percent(rate), *map(percent, pair)]
        yield [percent(asked), repr(float(np.mean(levels))), *cells]


def calibration_rows(runs: list[Evaluated]) -> Iterable[list]:
    """Yield rows [calibration_error, brier, cross_entropy] on the test part."""
    of_runs = [
        list(statistics.calibration(run.test.probabilities, run.test.label).values())
        for run in runs
    ]
    yield [f"{value:.6f}" for value in np.mean(of_runs, axis=0)]


def comparison_rows(first: list[Evaluated], second: list[Evaluated], seed: int) -> Iterable[list]:
    """Yield one row [resampled, seeds, difference, low, high] of two schemes on the same samples.

    Difference in percentage points, mean over the seeds; seeds: the smaller number of trainings of
    the two schemes.
    Raises: InputError where the schemes were tested on different samples.
    """
    seeds = min(len(first), len(second))
    generator = stream(seed, "bootstrap", first[0].protocol, first[0].scheme, second[0].scheme)
    interval = difference(first, second, generator)
    levels = ["seeds"] * (seeds > 1) + ["subtypes"] * whole_subtypes(first) + ["motion models"]
    yield [", ".join(levels), seeds, *map(percent, interval)]


def _write(path: Path, columns: list[str], rows: list[list]) -> None:
    """Write a table whose first columns are protocol and scheme."""
    write_csv(path, ["protocol", "scheme", *columns], rows)


def _one_set(runs: list[Evaluated]) -> tuple[str, ...]:
    """The classes that all runs share; refuses runs with different classes."""
    sets = sorted({run.classes for run in runs})
    if len(sets) != 1:
        raise InputError(
            f"predictions of the classes {' and '.join(map(str, sets))}, expected one set of "
            "classes"
        )
    return sets[0]


def _compared(groups: dict[tuple[str, str], list[Evaluated]], seed: int) -> list[list]:
    """The rows of comparisons.csv: each of CLAIMS in each protocol that has both of its schemes."""
    lines = []
    for protocol in ("seen", "unseen"):
        for better, other, claim in CLAIMS:
            first = groups.get((protocol, better))
            second = groups.get((protocol, other))
            if first and second:
                rows = comparison_rows(first, second, seed)
                lines += [[protocol, better, other, claim, *row] for row in rows]
    return lines


def write(
    runs: list[Evaluated], order: list[str], published: dict, folder: str | Path, seed: int
) -> None:
    """Write all tables into `folder`, by protocol (seen first), then by scheme as in `order`.

    published: as `paper_claims.read_published` gives it; seed: of the bootstrap.
    Raises: InputError for a scheme outside `order`, the same run twice, or runs with different
    classes.
    """
    groups: dict[tuple[str, str], list[Evaluated]] = {}
    for run in sorted(runs, key=lambda run: run.seed):
        if run.scheme not in order:
            raise InputError(
                f"scheme {run.scheme!r}: not in the table of schemes, which has {order}"
            )
        group = groups.setdefault((run.protocol, run.scheme), [])
        if any(other.seed == run.seed for other in group):
            raise InputError(
                f"{run.protocol} {run.scheme}: two prediction files of seed {run.seed}"
            )
        group.append(run)
    keys = sorted(groups, key=lambda key: (key[0], order.index(key[1])))
    share = ["accuracy_percent", "samples"]
    bands = ["from", "to", *share]
    rates = ("detected", *map(word, _one_set(runs)[1:]))
    alarm = ["asked_percent", "threshold"]
    for rate in rates:
        alarm += [f"{rate}_percent", f"{rate}_low", f"{rate}_high"]
    tables = {
        "accuracy": (list(ACCURACY), lambda group: accuracy_rows(group, "test", seed)),
        "seeds": (["seed", "accuracy_percent", *TRAINING, "hardware"], seed_rows),
        "confusion": (["category", "predicted", "samples"], confusion_rows),
        "confusion_by_snr": (["snr_db", "category", "predicted", "samples"], confusion_by_snr_rows),
        "subtypes": (["category", "subtype", *share], subtype_rows),
        "ranges": (bands, lambda group: band_rows(group, lambda test: test.range_m, 50)),
        "aspects": (bands, lambda group: band_rows(group, lambda test: test.aspect_deg, 30)),
        "alarms": (alarm, lambda group: alarm_rows(group, seed)),
        "calibration": (["calibration_error", "brier", "cross_entropy"], calibration_rows),
    }
    for name, (columns, rows_of) in tables.items():
        lines = []
        for key in keys:
            lines += [[*key, *row] for row in rows_of(groups[key])]
        _write(Path(folder) / f"{name}.csv", columns, lines)
    seen = []
    for protocol, scheme in keys:
        group = groups[protocol, scheme]
        if protocol == "unseen" and len(group[0].part("seen_test")):
            rows = accuracy_rows(group, "seen_test", seed)
            seen += [[protocol, scheme, *row] for row in rows]
    _write(Path(folder) / "seen_test.csv", list(ACCURACY), seen)
    compared = _compared(groups, seed)
    columns = ["over", "claim", "resampled", "seeds", "difference_points", "low", "high"]
    _write(Path(folder) / "comparisons.csv", columns, compared)
    columns = [
        "over",
        "claim",
        "paper_points",
        "seeds",
        "difference_points",
        "low",
        "high",
        "ordering",
    ]
    _write(Path(folder) / "orderings.csv", columns, list(ordering_rows(compared, published)))
