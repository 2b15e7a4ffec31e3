"""The radar's twin: a measured radar as a configuration of the same engine.

A continuous-wave radar is a network of one station with one subcarrier and single elements. Its
receiver gives a complex channel, or one real channel of which only the real part is kept.
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from lowalt.config.classes import CATEGORIES
from lowalt.config.command import pick
from lowalt.config.layers import load_yaml, merge
from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.extensions.recordings.channel import EDGE, ONE_SIDED_EDGE, SAMPLINGS
from lowalt.extensions.recordings.record import Record, record
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.spectra import Fourier, Spectra, Transfer

CHANNELS = ("complex", "real")
NO_CLASS = "none of these"
"""Name of the class of what belongs to no category, such as a hand that waves."""
RADARS = "config/measured/radars"
"""Folder of the records of the measured radars: each says what `lowalt recording train` makes its
network of.
"""
TRAINED_RATIO = 1.25
"""Largest ratio of a recording's carrier and the radar's: speeds in a spectrum scale with it."""


@dataclass(frozen=True)
class Twin:
    """A measured radar: `rate_hz` is the rate of its receiver, `symbol_interval_s` the interval of
    the images' symbols.

    A window holds a target where a line at or above `slowest_mps` (0: targets may hover) stands
    `detect_db` above the recording's noise floor. What is slower than `slowest_mps` is taken out of
    windows. The other fields are named as in a record.
    """

    carrier_hz: float
    channel: str
    rate_hz: float
    symbol_interval_s: float
    symbols: int
    sampling: str
    slowest_mps: float
    detect_db: float

    @classmethod
    def from_settings(cls, block: dict) -> "Twin":
        """Build from a block with exactly the fields' names.

        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        twin = cls(*pick(block, *cls.__dataclass_fields__))
        if twin.channel not in CHANNELS or twin.sampling not in SAMPLINGS:
            raise InputError(
                f"twin: channel {twin.channel!r}, sampling {twin.sampling!r}, expected one of"
                f" {CHANNELS} and of {SAMPLINGS}"
            )
        twin.network(2)
        return twin

    def at_carrier(self, carrier_hz: float) -> "Twin":
        """Return the twin at a recording's own carrier; the symbol interval stays, so the speeds
        scale a little.
        """
        return replace(self, carrier_hz=carrier_hz)

    def near(self, carrier_hz: float) -> bool:
        """Whether a network of this radar may be asked of a recording at a carrier (Hz)."""
        return 1 / TRAINED_RATIO <= carrier_hz / self.carrier_hz <= TRAINED_RATIO

    @property
    def edge_mps(self) -> float:
        """Largest unambiguous radial speed of the symbol rate, lambda / (4 T_r) (m/s)."""
        return SPEED_OF_LIGHT / self.carrier_hz / (4 * self.symbol_interval_s)

    @property
    def fastest_mps(self) -> float:
        """Largest speed that the sampling keeps (m/s): its filter ends there, and a bare line
        beyond it folds.
        """
        kept = {"anti_aliased": EDGE, "one_sided": 2 * ONE_SIDED_EDGE, "bare": 1.0}
        return kept[self.sampling] * self.edge_mps

    @property
    def slow(self) -> float:
        """Doppler of `slowest_mps` in cycles per symbol."""
        return self.slowest_mps / (2 * self.edge_mps)

    @property
    def sides(self) -> str:
        """Speeds that the symbol rate shows: "both" signs, "positive", or positive up to twice the
        edge ("wrapped").
        """
        if self.channel == "real" and self.sampling != "bare":
            return "positive" if self.sampling == "anti_aliased" else "wrapped"
        return "both"

    def network_settings(self) -> dict:
        """Return the one-station network of the images as a configuration's block `network`."""
        # With one subcarrier the spacing only sets the length of the one range cell, which nothing
        # depends on.
        return {
            "carrier_hz": self.carrier_hz,
            "subcarrier_spacing_hz": 1.0,
            "subcarriers": 1,
            "guard_subcarriers": 0,
            "symbol_interval_s": self.symbol_interval_s,
            "symbols": self.symbols,
            "transmit_array": [1, 1],
            "receive_array": [1, 1],
            "power_w": 1.0,
            "stations": {"A": {"position_m": [0.0, 0.0, 0.0], "normal_deg": 90.0}},
        }

    def network(self, symbols: int, interval_s: float | None = None) -> Network:
        """Return the one-station network of `symbols` at `interval_s` a symbol (by default that of
        the images).
        """
        network = Network.from_settings(self.network_settings() | {"symbols": symbols})
        return network if interval_s is None else replace(network, symbol_interval_s=interval_s)

    def spectra(self) -> Spectra:
        """Return the project's three spectra; the matched speeds cover this radar's unambiguous
        ones in 123 steps.
        """
        edge = float(f"{self.edge_mps:.3g}")
        return Spectra(
            vrp=Fourier(256, 1, 256),
            trp=Fourier(8, 1, 1024),
            vt=Transfer(8, 1, -edge, edge, edge / 61),
        )

    def spectra_settings(self) -> dict:
        """Return the spectra as a configuration's block `spectra`."""
        return {name: asdict(settings) for name, settings in self.spectra().items()}


ASKED = ("waveform", "distance_m", "height_m", "beam_deg")
"""Keys of the block `twin` that nothing else can say; the last three where a category has no scenes
of its own.
"""
FASTEST_MPS = 20.0
WINDOW_S = 0.4
LEAST_SYMBOLS = 400
MOST_SYMBOLS = 1200
"""Symbols of a window: the spectra need 400; more than 1200 add time and no class."""
SLOWEST_MPS = 0.4
DETECT_DB = 12.0
WHOLE = 0.02
"""How far the symbol rate may be moved for a whole number of samples per symbol."""
MOST_SAMPLES = 1_000_000
"""Largest number of simulated samples of a window."""


def twin_of(record: Record, rate_hz: float) -> Twin:
    """Return the twin of the radar that made a recording at `rate_hz` samples (or chirps, or OFDM
    symbols) a second.

    The symbol rate keeps speeds up to the block's `fastest_mps` apart where the radar is fast
    enough for it.
    Raises: InputError naming the keys of the block `twin` that are missing, a sampling that the
    channel has not, or rates that do not go together.
    """
    said = record.twin or {}
    asked_of = {*said.get("classes", CATEGORIES)} - {NO_CLASS}
    usual_scenes = asked_of - set(said.get("scenes", {}))
    missing = [key for key in (ASKED if usual_scenes else ASKED[:1]) if key not in said]
    if missing:
        raise InputError(
            f"{record.file}: the record says nothing of {', '.join(missing)}, expected a block twin"
            " such as {waveform: cw, distance_m: [2, 10], height_m: [-1, 2], beam_deg: 60}"
        )
    one_sided = record.channel == "real" and said.get("sampling", "one_sided") == "one_sided"
    # Unambiguous are lambda / 4 T of a complex channel, twice that of a one-sided one.
    wanted_hz = (
        (2 if one_sided else 4)
        * said.get("fastest_mps", FASTEST_MPS)
        * record.carrier_hz
        / SPEED_OF_LIGHT
    )
    every = max(1.0, rate_hz / wanted_hz)
    every = round(every) if abs(every - round(every)) < WHOLE * every else every
    interval_s = said.get("symbol_interval_s", every / rate_hz)
    usual = "one_sided" if one_sided else "anti_aliased"
    sampling = said.get(
        "sampling", usual if rate_hz * interval_s > 1 + 1e-9 or one_sided else "bare"
    )
    length = round(said.get("window_s", WINDOW_S) / interval_s)
    symbols = said.get("symbols", int(np.clip(length, LEAST_SYMBOLS, MOST_SYMBOLS)))
    simulated_hz = said.get(
        "simulated_hz", 1 / interval_s if sampling == "bare" else min(rate_hz, 2 / interval_s)
    )
    if not 1 - 1e-9 <= simulated_hz * interval_s <= MOST_SAMPLES / symbols:
        raise InputError(
            f"{record.file}: {symbols} values of {interval_s:.4g} s, simulated at"
            f" {simulated_hz:.6g} Hz, expected at least one sample per value, at most"
            f" {MOST_SAMPLES} per window"
        )
    slowest_mps = said.get("slowest_mps", SLOWEST_MPS)
    detect_db = said.get("detect_db", DETECT_DB)
    return Twin(
        record.carrier_hz,
        record.channel,
        simulated_hz,
        interval_s,
        symbols,
        sampling,
        slowest_mps,
        detect_db,
    )


def records(folder: str | Path = RADARS, over: dict | None = None) -> dict[str, Record]:
    """Return the records of radars in a folder by name, by rising carrier.

    over: for some of these radars, keys of the block `twin` to lay over those of the record.
    Raises: InputError naming the file and the key that is missing or wrong.
    """
    folder = shipped(folder)
    found = {}
    for path in sorted(folder.glob("*.yaml")):
        block = merge(
            load_yaml(path, "record of a radar"), {"twin": (over or {}).get(path.stem, {})}
        )
        found[path.stem] = record(block, folder, str(path))
        if found[path.stem].rate_hz is None:
            raise InputError(f"{path}: missing key(s) ['rate_hz']")
    if not found:
        raise InputError(f"{folder}: no record of a radar, expected files such as cw_24ghz.yaml")
    return dict(sorted(found.items(), key=lambda pair: pair[1].carrier_hz))


def radars(folder: str | Path = RADARS) -> dict[str, Twin]:
    """Return the twins of the records of radars in a folder by name.

    Raises: InputError as `records` and `twin_of`.
    """
    return {
        name: twin_of(about, float(about.rate_hz or 0)) for name, about in records(folder).items()
    }
