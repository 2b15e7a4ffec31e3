"""What a network of a measured radar's twin says of every window of a recording."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lowalt.extensions.recordings.files import read
from lowalt.extensions.recordings.presence import beyond_mps, present, without_hum
from lowalt.extensions.recordings.record import Record
from lowalt.extensions.recordings.twin import Twin, radars
from lowalt.extensions.recordings.window_samples import Windows, facts, rendered
from lowalt.extensions.recordings.windows import looks
from lowalt.files.errors import InputError
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.runs import Trained
from lowalt.tiles.image_settings import Images

ANOTHER = 0.02
"""Relative distance between carriers from which on a recording is of another radar than the
network's.
"""

FOLLOWED_S = 1.2
"""How long before and after a window the target is taken to be the same one (s)."""
LEAST_SHARE = 1e-3
"""Least probability of a class in a window, so that no single window outweighs those around it."""
UNNAMED = ("nothing", "beyond", "clipped", "lost")
"""Outcomes of windows that no network names."""


class Answers(NamedTuple):
    """Of n windows: their starts (n,) s, whether each holds a target (n,) bool, class probabilities
    (n, classes), whether each is clipped (n,) bool, the speed (n,) m/s of a line beyond
    `fastest_mps`, NaN for none, and whether samples of it are lost (n,) bool; `notes` say for which
    reasons an answer may be wrong.

    The probabilities of a window with a target are those of its track (`followed`). A window that
    is clipped, lost or has such a line counts as one without a target: the network cannot know it.
    """

    starts_s: np.ndarray
    present: np.ndarray
    probabilities: np.ndarray
    clipped: np.ndarray
    beyond_mps: np.ndarray
    lost: np.ndarray
    fastest_mps: float
    notes: list[str]

    def outcomes(self, classes: list[str]) -> list[str]:
        """Return what each window is: the most probable of `classes`, or one of `UNNAMED`."""
        names = np.array(classes, object)[self.probabilities.argmax(axis=1)]
        names[~self.present] = "nothing"
        names[np.isfinite(self.beyond_mps)] = "beyond"
        names[self.clipped] = "clipped"
        names[self.lost] = "lost"
        return names.tolist()

    def words(self, number: int, outcome: str) -> str:
        """Return what is said of one window by its outcome: its class and probability, or why it
        has none.
        """
        said = {
            "nothing": "nothing there",
            "clipped": "clipped by the receiver",
            "lost": "samples are lost: exact zeros",
            "beyond": (
                f"a line at {self.beyond_mps[number]:.3g} m/s, beyond the {self.fastest_mps:.3g}"
                " m/s of this network"
            ),
        }
        return said.get(outcome) or f"{100 * self.probabilities[number].max():6.2f} %  {outcome}"


def answers(
    trained: Trained,
    settings: dict,
    record: Record,
    where: str,
    images_of: Callable[[np.ndarray, Twin, Images, int], np.ndarray] | None = None,
) -> Answers:
    """Return what a network says of every window of a recording.

    settings: how the network's images are made of signals (`runs.opened`), with the block `radar`;
    where: the record's path; images_of: the function that makes the images, by default `rendered`.
    Raises: InputError where the network knows no recordings, the recording's carrier or channel is
    not the radar's, or the file cannot be read.
    """
    if "radar" not in settings:
        raise InputError(
            f"{trained.path}: knows no recordings, expected a network of a radar such as"
            f" {sorted(radars())}"
        )
    radar = Twin.from_settings(settings["radar"])
    if not radar.near(record.carrier_hz):
        near = [name for name, other in radars().items() if other.near(record.carrier_hz)]
        expected = f"a network of {near}"
        if not near:
            expected = "a network of your own radar, which `lowalt recording train` makes; the zoo has none"
        raise InputError(
            f"{where}: carrier_hz is {record.carrier_hz:.3g}, and {trained.path.stem} knows"
            f" {radar.carrier_hz:.3g}, expected {expected}"
        )
    twin = radar.at_carrier(record.carrier_hz)
    baseband = read(record)
    found = looks(record, twin, baseband)
    intervals = found.intervals.astype(np.complex64)
    # First the windows whose samples can be used, below those of them that hold a target.
    there = ~(found.clipped | found.lost)
    shown = intervals.copy()
    shown[there] = without_hum(intervals[there], twin)
    made_by = images_of or rendered
    images = made_by(shown, twin, Images.from_settings(settings["images"]), trained.size)
    count = len(intervals)
    numbers = np.arange(len(intervals))
    samples = Windows(
        images, facts(np.zeros(count, int), [record.name] * count, numbers, np.zeros(count), "")
    )
    shares = probabilities(trained.model, samples, numbers, Machine.here("fp32"), 64)
    values = baseband.values if twin.channel == "complex" else baseband.values.real
    beyond = beyond_mps(values, baseband.rate_hz, twin, count)
    starts = numbers * twin.symbols * twin.symbol_interval_s
    empty = None
    if record.empty_s and not twin.slowest_mps:
        empty = intervals[_empty(record, starts, twin, where, there)]
    there[there] = present(intervals[there], twin, empty)
    there &= ~np.isfinite(beyond)
    shares[there] = followed(shares[there], starts[there])
    notes = _notes(record, radar, settings.get("caution", ""), there.any())
    return Answers(
        starts, there, shares, found.clipped, beyond, found.lost, twin.fastest_mps, notes
    )


def followed(shares: np.ndarray, starts_s: np.ndarray) -> np.ndarray:
    """Return the class probabilities (n, classes) of windows, each averaged over those near it.

    The average is the geometric mean over the windows that start within `FOLLOWED_S`; a probability
    below `LEAST_SHARE` counts as that. A target is of one class throughout, although a single
    window may show it abeam or while it turns.
    shares: (n, classes) of the windows with a target; starts_s: (n,) s, ascending.
    """
    within_s = FOLLOWED_S * (1 + 1e-9)
    first = np.searchsorted(starts_s, starts_s - within_s)
    after = np.searchsorted(starts_s, starts_s + within_s)
    logarithms = np.log(np.maximum(shares, LEAST_SHARE))
    sums = np.concatenate([np.zeros((1, shares.shape[1])), logarithms.cumsum(axis=0)])
    together = np.exp((sums[after] - sums[first]) / (after - first)[:, None])
    return together / together.sum(axis=1, keepdims=True)


def _empty(
    record: Record, starts_s: np.ndarray, twin: Twin, where: str, sound: np.ndarray
) -> np.ndarray:
    """Which of the sound windows (n,) bool, by their starts (n,) s, lie where the record says that
    nothing was.
    """
    assert record.empty_s is not None  # asked only of a record that states it
    first, last = record.empty_s
    window_s = twin.symbols * twin.symbol_interval_s
    inside = sound & (starts_s >= first) & (starts_s + window_s <= last)
    if not inside.any():
        raise InputError(
            f"{where}: empty_s is {record.empty_s}, expected a stretch that holds at least one of "
            f"the {len(starts_s)} windows of {window_s:.3g} s, not clipped"
        )
    return inside


def _notes(record: Record, radar: Twin, caution: str, found: bool) -> list[str]:
    """For which reasons answers on a recording may be wrong; caution: what the network's file says
    of them; found: whether any window holds a target."""
    notes = [caution] if found and caution else []
    if abs(record.carrier_hz / radar.carrier_hz - 1) > ANOTHER:
        at = radar.carrier_hz / 1e9
        here = record.carrier_hz / 1e9
        notes.append(
            f"this network learned a radar at {at:.4g} GHz, and the recording is at {here:.4g} GHz:"
            " expect wrong classes; `lowalt recording train` makes a network for its radar"
        )
    if found and not radar.slowest_mps and record.empty_s is None:
        notes.append(
            "targets of this network may hover, so hum and slow noise count as targets: the "
            "record's key "
            "`empty_s: [FROM, TO]` names seconds without any target"
        )
    return notes
