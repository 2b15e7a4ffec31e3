"""Rows that others submit: a folder of submissions is scored anew and its table written from it.

A submission is a folder NAME with card.yaml and a file of answers TRACK-SEED.csv per track and
training seed. The card has one line for each of CARD, and perhaps `confirmed`: by track, what
`lowalt benchmark confirm --json` printed.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from lowalt.extensions.benchmark import submission
from lowalt.extensions.benchmark.baseline_table import BY_SUBTYPE, CONFIRMED, RESULT
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, Track
from lowalt.extensions.benchmark.definition import REFERENCE
from lowalt.extensions.benchmark.scoring import scores
from lowalt.files.atomic import sha256, slug
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError, shown
from lowalt.files.yaml_files import load_yaml

FOLDER = f"{REFERENCE}/submissions"
CARD = (
    "method",
    "input",
    "settings",
    "chosen_on",
    "seeds",
    "hardware",
    "core_s",
    "code",
    "contact",
    "licence",
)
"""Lines of a card: what the method is, what it sees, its settings, on which part they were chosen
and how many were tried, training seeds, hardware and core-seconds of a training, where its code is,
whom to ask, and its licence."""
TABLE = "submissions.csv"
COLUMNS = (
    "submission",
    *RESULT,
    *CONFIRMED,
    "answers_sha256",
    "code",
)
PLAIN = re.compile(r"[^\W_][^<>|=`\x00-\x1f\x7f]*")
"""Texts of a card that enter the table: no formula of a table calculation, no markup of a page."""
ANSWERS = re.compile(r"(?P<track>[a-z0-9-]+)-(?P<seed>\d+)\.csv")


class Submission(NamedTuple):
    """One submission: its name, its card, and its files of answers by track."""

    name: str
    card: dict
    answers: dict[str, list[Path]]


def read(folder: str | Path) -> Submission:
    """Return a submission. Raises: InputError naming what is missing, unknown or wrong."""
    folder = Path(folder)
    if slug(folder.name) != folder.name:
        raise InputError(f"{folder}: expected a name of lower-case letters, digits and hyphens")
    card = load_yaml(folder / "card.yaml")
    missing = [name for name in CARD if card.get(name) in (None, "")]
    unknown = [name for name in card if name not in (*CARD, "confirmed")]
    if missing or unknown:
        raise InputError(
            f"{folder}/card.yaml: missing {missing}, unknown {unknown}, expected {list(CARD)}"
        )
    for name in ("method", "chosen_on", "code"):
        if not PLAIN.fullmatch(str(card[name])):
            raise InputError(
                f"{folder}/card.yaml: {name} is {shown(card[name])}, expected text that begins with"
                " a letter or digit, without <>|=` and control characters"
            )
    answers: dict[str, list[Path]] = {}
    for path in sorted(folder.glob("*.csv")):
        found = ANSWERS.fullmatch(path.name)
        if not found or found["track"] not in TRACKS:
            raise InputError(
                f"{path}: expected a name TRACK-SEED.csv with a track of {list(TRACKS)}"
            )
        answers.setdefault(found["track"], []).append(path)
    if not answers:
        raise InputError(
            f"{folder}: no file of answers, expected TRACK-SEED.csv such as unseen-0.csv"
        )
    return Submission(folder.name, card, answers)


def row(submitted: Submission, track: Track) -> dict:
    """Return the table's row of a submission on a track, scored from its files.

    Raises: as `submission.read`.
    """
    paths = submitted.answers[track.name]
    found = scores(track, [submission.read(path, track) for path in paths], {})
    percent = found["percent"]
    cells = {
        "submission": submitted.name,
        "track": track.name,
        "method": submitted.card["method"],
        "seeds": len(paths),
        "chosen_on": submitted.card["chosen_on"],
        "percent": f"{percent.value:.6g}",
        "low": f"{percent.low:.6g}",
        "high": f"{percent.high:.6g}",
        "macro_f1_percent": f"{found['macro_f1_percent'].value:.6g}",
        "answers_sha256": " ".join(sha256(path) for path in paths),
        "code": submitted.card["code"],
    }
    for name in BY_SUBTYPE:
        if name in found:
            cells[name] = f"{found[name]:.6g}"
    return cells | _confirmed(submitted, track)


def _confirmed(submitted: Submission, track: Track) -> dict:
    """The columns of a confirmed result that a card states. Raises: InputError for another form."""
    stated = (submitted.card.get("confirmed") or {}).get(track.name)
    if stated is None:
        return {}
    try:
        cells = [f"{float(value):.6g}" for value in stated["percent"]]
        return dict(zip(CONFIRMED, (*cells, str(stated["sha256"])), strict=True))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{submitted.name}/card.yaml: confirmed.{track.name} is {shown(stated)}, expected what "
            "`lowalt benchmark confirm --json` prints"
        ) from error


def rows(folder: str | Path) -> Iterator[dict]:
    """Yield the rows of all submissions of a folder, by name and in the order of the tracks.
    Raises: as `read`.
    """
    for path in sorted(Path(folder).iterdir()):
        if path.is_dir():
            submitted = read(path)
            for track in TRACKS.values():
                if track.name in submitted.answers:
                    yield row(submitted, track)


def write(folder: str | Path, found: list[dict]) -> Path:
    """Write the table of a folder's submissions into it; return its path."""
    path = Path(folder) / TABLE
    write_csv(path, COLUMNS, found)
    return path
