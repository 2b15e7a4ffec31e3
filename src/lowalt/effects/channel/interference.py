"""Other stations' signals in a receiver: from mast to mast and by the target, with data that the receiver lacks.

A station hears every other one; a link hears all stations except its sender, and so the transmitter next to its own
receiver. Where sub-bands overlap (`guard_subcarriers` below 0) the other station's subcarriers arrive at their full
level, elsewhere its leakage does. Division by the receiver's own data makes both noise: of the powers |Y_m|^2 of M
subcarriers every range cell gets sum_m |Y_m|^2 / M^2. All beams point at the same target. Symbols follow each other
without a pause; a signal later than the cyclic prefix, or early by a clock's error, brings part of another symbol.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.effects import clocks, prefix, steering, waveform
from lowalt.effects.checks import CheckedScene
from lowalt.effects.crossing import crossing
from lowalt.effects.listening import Listening
from lowalt.effects.sending import Sending
from lowalt.effects.view import View

SOURCE = (
    "3GPP TS 38.104, 6.6.3 (adjacent channel leakage ratio of base stations, 45 dB below 7 GHz; here the same at any "
    "distance in frequency); H. T. Friis 1946 (from mast to mast); M. Braun, OFDM Radar Algorithms in Mobile "
    "Communication Networks, KIT 2014, ch. 4 and 5 (other nodes as noise); 80 dB to the own transmitter: estimate"
)
DEFAULTS = {
    "leakage_db": 45.0, "loss_db": 0.0, "by_target": True, "isolation_db": 80.0, "prefix_s": None,
    "sigma_ppm": 0.017, "sigma_s": 2e-8,
}  # fmt: skip

OFFSETS = ("sigma_ppm", "sigma_s")


class Arrival(NamedTuple):
    """One way of another station's signal: its response on the receiver's subcarriers, and when it comes."""

    sender: str
    way: str
    response: np.ndarray
    """(N, M) or (1, M), as if the whole sub-band were the sender's."""
    delay_s: float


def idle(settings: dict) -> bool:
    """Return whether no way leads to the receiver."""
    return settings["loss_db"] is None and settings["isolation_db"] is None and not settings["by_target"]


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a single station, or settings that another effect contradicts."""
    if len(stations(scene.network)) < 2:
        raise InputError("effects.interference: the network has one station, expected at least two")
    for other, keys in (("link_offset", OFFSETS), ("cyclic_prefix", ("prefix_s",))):
        theirs = scene.effects.get(other, settings)
        for key in keys:
            if theirs[key] != settings[key]:
                raise InputError(
                    f"effects.interference.{key}: {settings[key]}, expected {theirs[key]} as in effects.{other}"
                )


def stations(network: Network) -> list[Station]:
    """Return the network's stations without its links."""
    return [station for station in network.stations if station.transmitter is None]


def others(view: View) -> list[Station]:
    """Return the stations that the receiver of `view` hears without knowing their data."""
    wanted = (view.station.transmitter or view.station).name
    return [station for station in stations(view.network) if station.name != wanted]


def lying(settings: dict, network: Network, sends: Station, hears: Station) -> tuple[np.ndarray, int]:
    """Return the amplitude (M,) with which each of the receiver's subcarriers is sent, and the sender's first one.

    1 where the sub-bands overlap, elsewhere the leakage. Subcarriers count from the receiver's lowest.
    """
    first = round((sends.frequency_hz - hears.frequency_hz) / network.subcarrier_spacing_hz)
    own = np.arange(network.subcarriers) - first
    leaked = 0.0 if settings["leakage_db"] is None else 10 ** (-settings["leakage_db"] / 20)
    return np.where((own >= 0) & (own < network.subcarriers), 1.0, leaked), first


def pair(view: View, sends: Station) -> View:
    """Return the target as the receiver of `view` hears it in the signal of another station, or of its own one."""
    hears = replace(view.station.receiver or view.station, frequency_hz=view.station.frequency_hz)
    if sends.name == hears.name:
        return view.of(hears)
    there = replace(sends, frequency_hz=view.station.frequency_hz)
    name = f"{sends.name}-{hears.name}"
    return view.of(Station(name, hears.position_m, hears.normal_rad, hears.frequency_hz, there, hears))


def arrivals(
    settings: dict, view: View, sends: Station, names: frozenset[str], weight: Callable[[View], np.ndarray | float]
) -> list[Arrival]:
    """Return the ways of a station's signal to the receiver of `view`; names, weight: as in `Listening`."""
    found, seen = [], pair(view, sends)
    if seen.station.transmitter is None:
        if settings["isolation_db"] is not None:
            level = np.sqrt(view.network.power) * 10 ** (-settings["isolation_db"] / 20)
            found.append(Arrival(sends.name, "directly", np.full((1, view.network.subcarriers), level, complex), 0.0))
    elif settings["loss_db"] is not None:
        response, delay_s = crossing(view, seen.station.transmitter, seen.station)
        found.append(Arrival(sends.name, "directly", response[None] * 10 ** (-settings["loss_db"] / 20), delay_s))
    if settings["by_target"]:
        on = {name: name in names for name in ("squint", "wavefront")}
        response = steering.echo(seen, factor=weight(seen), **on)
        ends = seen.station.transmitter or seen.station, seen.station
        ways_m = sum(float(np.linalg.norm(view.origin_m - np.asarray(end.position_m))) for end in ends)
        found.append(Arrival(sends.name, "by the target", response, ways_m / SPEED_OF_LIGHT))
    return found


def heard(settings: dict, given: Listening) -> np.ndarray | None:
    """Return the time samples (N, M) of all other stations' signals, None where nothing of them reaches the receiver.

    Their data and leakage are drawn by receiver, their clocks and oscillators by look, as `link_offset` draws them.
    """
    view, sending, names, draws, weight = given
    network, total = view.network, None
    errors = clocks.errors(settings, network, draws(clocks.STREAM))
    own = errors[(view.station.receiver or view.station).name]
    # `link_offset` will move all samples of a link by its sender's offsets less the receiver's.
    moved = errors[view.station.transmitter.name] if view.station.transmitter and "link_offset" in names else own
    sample_s = 1 / (network.subcarriers * network.subcarrier_spacing_hz)
    times_s = view.times_s[:, None] + np.arange(network.subcarriers) * sample_s
    oscillator_hz = view.station.frequency_hz + network.subcarriers // 2 * network.subcarrier_spacing_hz
    for sends in others(view):
        level, first = lying(settings, network, sends, view.station)
        if not level.any():
            continue
        ppm, shift_s = (theirs - ours for theirs, ours in zip(errors[sends.name], moved, strict=True))
        late_s = errors[sends.name][1] - own[1]
        data = _Data(sending, draws, sends.name, level, first)
        ramp = np.exp(-2j * np.pi * waveform.baseband_hz(network) * shift_s)
        samples = sum(
            _windowed(settings, network, one.response * ramp, one.delay_s + late_s, data)
            for one in arrivals(settings, view, sends, names, weight)
        )
        samples = samples * waveform.turned(2e-6 * np.pi * ppm * oscillator_hz * times_s)
        total = samples if total is None else total + samples
    return total


class _Data:
    """A station's data (N, M) as they lie on the receiver's subcarriers, symbol by symbol of the stream."""

    def __init__(self, sending: Sending, draws: Callable, name: str, level: np.ndarray, first: int):
        self.sending, self.draws, self.name, self.level, self.first = sending, draws, name, level, first
        self.kept: dict[str, np.ndarray] = {}

    def __getitem__(self, symbol: str) -> np.ndarray:
        """The data of the "waveform", the "previous waveform" or the "next waveform"."""
        if symbol not in self.kept:
            shape = self.sending.network.symbols, len(self.level)
            own = np.arange(shape[1]) - self.first
            whole, result = np.flatnonzero((own >= 0) & (own < shape[1])), np.zeros(shape, np.complex128)
            if len(whole) < shape[1]:
                noise = self.draws(f"leakage of {self.name}, {symbol}").standard_normal((*shape, 2))
                result = self.level * np.sqrt(0.5) * noise.view(np.complex128)[..., 0]
            if len(whole):
                result[:, whole] = self.sending.aired_as(f"{symbol} of {self.name}")[:, whole - self.first]
            self.kept[symbol] = result
        return self.kept[symbol]


def _windowed(settings: dict, network: Network, response: np.ndarray, late_s: float, data: _Data) -> np.ndarray:
    """Time samples (N, M) of a response (N, M) in a receive window that this signal reaches `late_s` late."""
    samples = waveform.transmit(response, data["waveform"])
    count, rate = network.subcarriers, network.subcarriers * network.subcarrier_spacing_hz
    before = int(np.clip(np.ceil((late_s - prefix.length_s(settings, network)) * rate), 0, count))
    after = int(np.clip(np.floor(-late_s * rate), 0, count))
    turn = prefix.turn(settings, network, waveform.baseband_hz(network))
    if before:
        samples[:, :before] = waveform.transmit(response * turn, data["previous waveform"])[:, :before]
    if after:
        rows = slice(count - after, None)
        samples[:, rows] = waveform.transmit(response * turn.conj(), data["next waveform"])[:, rows]
    return samples
