"""The network of base stations: carrier, subcarriers, symbols, arrays and station positions.

This module describes the radar; `lowalt.echo` computes its signals.
Axes: x and y horizontal, z up, metres, global frame. Angles in degrees only in the configuration.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable

SPEED_OF_LIGHT = 299_792_458.0
"""Speed of light in m/s (exact by definition of the metre)."""


def _positive(name: str, value: float, *, whole: bool = False) -> None:
    """Raise InputError unless the value is a positive finite number, or integer for `whole`."""
    number = isinstance(value, (int, float, np.integer, np.floating))
    positive = number and not isinstance(value, bool) and math.isfinite(value) and value > 0
    if whole and not (positive and float(value).is_integer()):
        raise InputError(f"network: {name} is {value!r}, expected a positive integer")
    if not positive:
        raise InputError(f"network: {name} is {value!r}, expected a positive finite number")


@dataclass(frozen=True)
class Station:
    """One base station: `position_m` (x, y, z) of its arrays, `normal_rad` Theta_k, and f_k.

    f_k, `frequency_hz`, is its lowest subcarrier.
    """

    name: str
    position_m: tuple[float, float, float]
    normal_rad: float
    frequency_hz: float
    transmitter: "Station | None" = None
    receiver: "Station | None" = None
    """The two stations of a link, otherwise None.

    A link has the receiver's position and the transmitter's frequency.
    """

    @property
    def horizontal(self) -> np.ndarray:
        """Unit vector y'_k along the array's horizontal axis, shape (3,)."""
        sine, cosine = portable.sine_cosine(self.normal_rad)
        return np.array([-sine, cosine, 0.0])


def _link(name: str, block: dict, known: dict[str, Station]) -> Station:
    """The link of a block {transmit, receive} with the names of two known stations."""
    sender = block["transmit"]
    receiver = block["receive"]
    if sender not in known or receiver not in known or sender == receiver:
        raise InputError(
            f"network: stations.{name}: from {sender!r} to {receiver!r}, expected two of "
            f"{sorted(known)}"
        )
    sends = known[sender]
    hears = known[receiver]
    return Station(name, hears.position_m, hears.normal_rad, sends.frequency_hz, sends, hears)


def station_names(block: dict) -> list[str]:
    """Return the names of the stations of a `network` block in alphabetical order.

    Settings are passed as JSON with sorted keys, so every stage sees this order.
    """
    return sorted(block["stations"])


def as_far_as(block: dict, name: str) -> dict:
    """Return a `network` block with only those stations that the echo at `name` depends on.

    Its sub-band depends on the number of stations before it; a link needs the two stations that it
    connects.
    """
    stations = block["stations"]
    own = stations[name]
    last = max(name, own.get("transmit", name), own.get("receive", name))
    kept = {}
    for other, settings in stations.items():
        is_link = "transmit" in settings
        if other == name or (other <= last and not is_link):
            kept[other] = settings
    return {**block, "stations": kept}


def masts_m(block: dict) -> list[list[float]]:
    """Return the positions [x, y] (m) of the stations of a `network` block, in its order.

    Links have no position.
    """
    stations = block["stations"].values()
    return [settings["position_m"][:2] for settings in stations if "position_m" in settings]


TERMS = {"ofdm": set(), "fmcw": {"sweep_hz", "sweep_s", "samples"}, "cw": set()}
"""Keys that a waveform of each kind has, next to `kind`."""
OFDM = ("subcarriers", "subcarrier_spacing_hz", "guard_subcarriers")
"""Keys of a `network` block that only OFDM has."""


def band(block: dict) -> dict:
    """Return the keys `OFDM` of a `network` block whose waveform may state its band otherwise.

    Sample m of an FMCW sweep is measured at the frequency of subcarrier m; a continuous wave is one
    subcarrier whose symbol lasts from one sample to the next.
    Raises: InputError naming the key and value that is missing, unknown or contradicts the
    waveform.
    """
    waveform = block.get("waveform", {"kind": "ofdm"})
    kind = waveform.get("kind")
    terms = set(waveform) - {"kind"}
    if kind not in TERMS or terms != TERMS[kind]:
        known = []
        for name, keys in TERMS.items():
            listed = ", ".join([f"kind: {name}", *sorted(keys)])
            known.append(f"{{{listed}}}")
        raise InputError(f"network.waveform: {waveform}, expected {' or '.join(known)}")
    given = {key: block[key] for key in OFDM if key in block}
    if kind == "ofdm":
        return given
    if given:
        raise InputError(
            f"network: {given} together with a waveform of kind {kind!r}, expected none of "
            f"{list(OFDM)}"
        )
    interval_s = block.get("symbol_interval_s", math.inf)
    if kind == "cw":
        subcarriers = 1
        spacing_hz = 1 / interval_s
    else:
        sweep_s = waveform["sweep_s"]
        if sweep_s > interval_s:
            raise InputError(
                f"network.waveform: sweep_s is {sweep_s:g}, expected at most symbol_interval_s, "
                f"{interval_s:g}"
            )
        subcarriers = waveform["samples"]
        spacing_hz = waveform["sweep_hz"] / subcarriers
    return {
        "subcarriers": subcarriers,
        "subcarrier_spacing_hz": spacing_hz,
        "guard_subcarriers": 0,
    }


@dataclass(frozen=True)
class Network:
    """The stations and the signal they share.

    `transmit` and `receive` are (horizontal, vertical) element counts; `power` is rho P, the power
    that each subcarrier carries for sensing (W, 1 by default); a symbol carries `subcarriers` times
    as much, while an FMCW sweep or a continuous wave has `power` at each instant. `waveform` is
    "ofdm", "fmcw" or "cw"; `sweep_s` is how long the samples of an FMCW sweep take, which is a
    symbol then.
    Source: paper, section II-A and V-A.
    """

    carrier_hz: float
    subcarrier_spacing_hz: float
    subcarriers: int
    guard_subcarriers: int
    symbol_interval_s: float
    symbols: int
    transmit: tuple[int, int]
    receive: tuple[int, int]
    power: float
    stations: tuple[Station, ...]
    waveform: str = "ofdm"
    sweep_s: float | None = None

    def __post_init__(self) -> None:
        for name in ("carrier_hz", "subcarrier_spacing_hz", "symbol_interval_s", "power"):
            _positive(name, getattr(self, name))
        for name in ("subcarriers", "symbols"):
            _positive(name, getattr(self, name), whole=True)
        for array in ("transmit", "receive"):
            for count in getattr(self, array):
                _positive(f"array {array}", count, whole=True)
        if not self.stations:
            raise InputError("network: stations is empty, expected at least one")

    @classmethod
    def from_settings(cls, block: dict) -> "Network":
        """Build the network from the configuration's `network` block.

        Sub-bands follow each other in the alphabetical order of the stations: f_{k+1} = f_k + (M -
        1 + guard) df. A link {transmit, receive} between two stations has the sub-band of the one
        that sends.
        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        keys = {
            *OFDM,
            "carrier_hz",
            "symbol_interval_s",
            "symbols",
            "transmit_array",
            "receive_array",
            "power_w",
            "stations",
        }
        waveform = block.get("waveform", {"kind": "ofdm"})
        block = {key: value for key, value in (block | band(block)).items() if key != "waveform"}
        if set(block) != keys:
            raise InputError(f"network: keys {sorted(set(block) ^ keys)} missing or unknown")
        spacing_hz = block["subcarrier_spacing_hz"]
        step_hz = (block["subcarriers"] - 1 + block["guard_subcarriers"]) * spacing_hz
        if step_hz < 0:
            raise InputError(
                f"network: guard_subcarriers is {block['guard_subcarriers']}, expected at least "
                f"{1 - block['subcarriers']}, at which all stations share one sub-band"
            )
        names = station_names(block)
        base_stations: dict[str, Station] = {}
        for name in names:
            settings = block["stations"][name]
            if "transmit" in settings:
                continue
            position = tuple(float(value) for value in settings["position_m"])
            if len(position) != 3 or not all(map(math.isfinite, position)):
                raise InputError(
                    f"network: stations.{name}.position_m is {position}, expected three finite "
                    "metres"
                )
            normal = math.radians(settings["normal_deg"])
            lowest_hz = block["carrier_hz"] + len(base_stations) * step_hz
            base_stations[name] = Station(name, position, normal, lowest_hz)
        stations = []
        for name in names:
            if name in base_stations:
                stations.append(base_stations[name])
            else:
                stations.append(_link(name, block["stations"][name], base_stations))
        return cls(
            carrier_hz=block["carrier_hz"],
            subcarrier_spacing_hz=block["subcarrier_spacing_hz"],
            subcarriers=block["subcarriers"],
            guard_subcarriers=block["guard_subcarriers"],
            symbol_interval_s=block["symbol_interval_s"],
            symbols=block["symbols"],
            transmit=tuple(block["transmit_array"]),
            receive=tuple(block["receive_array"]),
            power=block["power_w"],
            stations=tuple(stations),
            waveform=waveform["kind"],
            sweep_s=waveform.get("sweep_s"),
        )

    def station(self, name: str) -> Station:
        """Return the station called `name`.

        Raises: InputError naming the stations there are.
        """
        for station in self.stations:
            if station.name == name:
                return station
        known = [station.name for station in self.stations]
        raise InputError(f"station {name!r}: not in the network, which has {known}")

    @property
    def times_s(self) -> np.ndarray:
        """Symbol times n T_r (s), shape (symbols,)."""
        return np.arange(self.symbols) * self.symbol_interval_s

    @property
    def symbol_rate_hz(self) -> float:
        """One over the time of the samples of a symbol or sweep (Hz); the spacing of OFDM."""
        if self.sweep_s is None:
            return self.subcarrier_spacing_hz
        return 1 / self.sweep_s

    @property
    def bin_name(self) -> str:
        """What a value of Eq. 24 belongs to, in words: a subcarrier, or a sample of other waves."""
        if self.waveform == "ofdm":
            return "one subcarrier"
        return "one sample"

    @property
    def noise_bandwidth_hz(self) -> float:
        """Noise bandwidth (Hz) of a value of Eq. 24: of a subcarrier, or a sweep's sample rate."""
        if self.sweep_s is None:
            return self.symbol_rate_hz
        return self.symbol_rate_hz * self.subcarriers

    def effective_hz(self, station: Station) -> float:
        """Return the effective carrier f_k + (M - 1) df / 2 (Hz).

        It determines phase and Doppler in a range cell. Source: paper, Eq. 7, the inverse transform
        over subcarriers.
        """
        return station.frequency_hz + (self.subcarriers - 1) * self.subcarrier_spacing_hz / 2

    def largest_mps(self, station: Station) -> float:
        """Return the largest speed that does not fold, c / (4 f T_r) (m/s).

        f is the effective carrier. The phase of faster targets turns by more than half a circle per symbol.
        """
        return SPEED_OF_LIGHT / (4 * self.effective_hz(station) * self.symbol_interval_s)

    def folding(self, published: Iterable[dict]) -> str:
        """Return a sentence where targets move at speeds that fold here, else an empty text.

        published: the targets' rows of the table of targets. The sentence names a symbol interval
        at which no speed folds.
        """
        columns = ("vx_abs_max", "vy_abs_max", "vz_abs_max", "speed_hi")
        fastest = 0.0
        for row in published:
            speeds = [row[column] or 0.0 for column in columns]
            fastest = max(fastest, math.hypot(*speeds))
        largest = min(map(self.largest_mps, self.stations))
        interval_s = self.symbol_interval_s
        if fastest <= largest:
            return ""
        none_s = 0.95 * interval_s * largest / fastest
        return (
            f"radial speeds beyond {largest:.3g} m/s fold, targets move at up to {fastest:.3g} "
            f"m/s: network.symbol_interval_s is {interval_s:g}, at {none_s:.2g} none would fold"
        )

    def range_folding(self, polygon_m: Iterable | None) -> str:
        """Return a sentence where targets are beyond the unambiguous range, else an empty text.

        polygon_m: corners (K, 2) of the region of targets, None for the polygon of the masts. The
        unambiguous range is c / (2 df); the sentence names a value at which no range folds.
        """
        if polygon_m is None:
            polygon_m = [
                station.position_m[:2] for station in self.stations if station.transmitter is None
            ]
        corners = np.array(polygon_m, float)
        ranges_m = []
        for station in self.stations:
            sends = station.transmitter or station
            hears = station.receiver or station
            out = np.linalg.norm(corners - sends.position_m[:2], axis=1)
            back = np.linalg.norm(corners - hears.position_m[:2], axis=1)
            ranges_m.append((out + back) / 2)
        farthest = np.max(ranges_m)
        reach = self.subcarriers * self.cell_m
        if farthest <= reach:
            return ""
        if self.waveform == "fmcw":
            key = "waveform.samples"
            value: float = self.subcarriers
            none_folds = math.ceil(value * farthest / reach)
        else:
            key = "subcarrier_spacing_hz"
            value = self.subcarrier_spacing_hz
            none_folds = math.floor(value * reach / farthest)
        return (
            f"ranges beyond {reach:.4g} m fold, targets are up to {farthest:.4g} m from a station: "
            f"network.{key} is {value:g}, at {none_folds} none would fold, nor in a smaller "
            "motion.region or with stations closer together"
        )

    def folded_mps(self, speed_mps: np.ndarray, station: Station) -> np.ndarray:
        """Return the speeds (m/s, any shape) at which a station sees radial speeds.

        They are above -largest and up to largest.
        """
        largest = self.largest_mps(station)
        return largest - (largest - speed_mps) % (2 * largest)

    def bin_speeds_mps(self, points: int, station: Station) -> np.ndarray:
        """Return the radial speeds (points,) m/s of a Fourier transform over symbols, ascending.

        Positive speeds recede. Bin k of `numpy.fft.fftfreq` is the speed -2 k / points times the
        largest: an echo that recedes turns backwards.
        """
        return -2 * self.largest_mps(station) * np.fft.fftshift(np.fft.fftfreq(points))[::-1]

    @property
    def cell_m(self) -> float:
        """Length of a range cell, c / (2 M df) (m)."""
        return SPEED_OF_LIGHT / (2 * self.subcarriers * self.subcarrier_spacing_hz)
