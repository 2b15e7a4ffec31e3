"""Other stations' signals in a receiver: from mast to mast and by the target, with data that the receiver lacks.

A station hears every other one; a link hears all stations except its sender, and so the transmitter next to its own
receiver. Where sub-bands overlap (`guard_subcarriers` below 0) the other station's subcarriers arrive at their full
level, elsewhere its leakage does. Division by the receiver's own data makes both noise: of the powers |Y_m|^2 of M
subcarriers every range cell gets sum_m |Y_m|^2 / M^2. All beams point at the same target. Symbols follow each other
without a pause; a signal later than the cyclic prefix, or early by a clock's error, brings part of another symbol.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.files.errors import InputError
from lowalt.scene import clocks, waveform
from lowalt.scene.checks import CheckedScene
from lowalt.scene.crossing import crossing
from lowalt.scene.listening import Listening
from lowalt.scene.prefix import length_s, turn

SOURCE = (
    "3GPP TS 38.104, 6.6.3 (adjacent channel leakage ratio of base stations, 45 dB below 7 GHz; here the same at any "
    "distance in frequency); H. T. Friis 1946 (from mast to mast); M. Braun, OFDM Radar Algorithms in Mobile "
    "Communication Networks, KIT 2014, ch. 4 and 5 (other nodes as noise); 80 dB to the own transmitter: estimate"
)
DEFAULTS = {
    "leakage_db": 45.0, "loss_db": 0.0, "by_target": True, "isolation_db": 80.0, "prefix_s": None,
    "sigma_ppm": 0.017, "sigma_s": 2e-8,
}  # fmt: skip


def idle(settings: dict) -> bool:
    """Return whether no way leads to the receiver."""
    return settings["loss_db"] is None and settings["isolation_db"] is None and not settings["by_target"]


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a single station, or settings that another effect contradicts."""
    if len(stations(scene.network)) < 2:
        raise InputError("effects.interference: the network has one station, expected at least two")
    for other, keys in (("link_offset", ("sigma_ppm", "sigma_s")), ("cyclic_prefix", ("prefix_s",))):
        theirs = scene.effects.get(other, settings)
        for key in keys:
            if theirs[key] != settings[key]:
                raise InputError(
                    f"effects.interference.{key}: {settings[key]}, expected {theirs[key]} as in effects.{other}"
                )


def stations(network: Network) -> list[Station]:
    """Return the network's stations without its links."""
    return [station for station in network.stations if station.transmitter is None]


def arrivals(settings: dict, given: Listening, sends: Station) -> list[tuple[np.ndarray, float]]:
    """Return the ways of a station's signal to the receiver: from mast to mast, and by the target.

    Each is its response (N or 1, M) on the receiver's subcarriers, as if the whole sub-band were the sender's, and its
    delay (s). The receiver's own transmitter reaches it by `isolation_db` instead of from mast to mast.
    """
    view, network, result = given.view, given.view.network, []
    hears = replace(view.station.receiver or view.station, frequency_hz=view.station.frequency_hz)
    there, link = replace(sends, frequency_hz=hears.frequency_hz), hears
    if sends.name != hears.name:
        link = replace(hears, name=f"{sends.name}-{hears.name}", transmitter=there, receiver=hears)
    if link is hears and settings["isolation_db"] is not None:
        level = np.sqrt(network.power) * 10 ** (-settings["isolation_db"] / 20)
        result.append((np.full((1, network.subcarriers), level, np.complex128), 0.0))
    if link is not hears and settings["loss_db"] is not None:
        response, delay_s = crossing(view, there, hears)
        result.append((response[None] * 10 ** (-settings["loss_db"] / 20), delay_s))
    if settings["by_target"]:
        ways_m = sum(float(np.linalg.norm(view.origin_m - np.asarray(end.position_m))) for end in (there, hears))
        result.append((given.echo(view.of(link)), ways_m / SPEED_OF_LIGHT))
    return result


def heard(settings: dict, given: Listening) -> np.ndarray | None:
    """Return the time samples (N, M) of all other stations' signals, None where nothing of them reaches the receiver.

    Their data and leakage are drawn by receiver, their clocks and oscillators by look, as `link_offset` draws them.
    """
    view, network, total = given.view, given.view.network, None
    errors, known = clocks.errors(settings, network, given.draws(clocks.STREAM)), view.station.transmitter
    own = errors[(view.station.receiver or view.station).name]
    # `link_offset` will move all samples of a link by its sender's offsets less the receiver's.
    moved = errors[known.name] if known is not None and "link_offset" in given.names else own
    step_hz, middle = network.subcarrier_spacing_hz, network.subcarriers // 2
    number = np.arange(network.subcarriers)
    for sends in stations(network):
        data = sent(settings, given, sends)
        if sends.name == (known or view.station).name or data is None:
            continue
        ppm, shift_s = (theirs - ours for theirs, ours in zip(errors[sends.name], moved, strict=True))
        ramp = np.exp(-2j * np.pi * (number - middle) * step_hz * shift_s)
        samples = sum(
            _windowed(settings, network, response * ramp, delay_s + errors[sends.name][1] - own[1], data)
            for response, delay_s in arrivals(settings, given, sends)
        )
        turn_hz = 1e-6 * ppm * (view.station.frequency_hz + middle * step_hz)
        within = np.exp(2j * np.pi * turn_hz * number / (network.subcarriers * step_hz))
        samples = samples * within * np.exp(2j * np.pi * turn_hz * view.times_s)[:, None]
        total = samples if total is None else total + samples
    return total


def sent(settings: dict, given: Listening, sends: Station) -> Callable[[str], np.ndarray] | None:
    """Return a station's data (N, M) on the receiver's subcarriers, by their symbols' name; None where it sends none.

    Where sub-bands overlap they are its subcarriers, elsewhere its leakage, which is noise.
    """
    network, leakage_db = given.view.network, settings["leakage_db"]
    first = round((sends.frequency_hz - given.view.station.frequency_hz) / network.subcarrier_spacing_hz)
    number = np.arange(network.subcarriers) - first
    whole = np.flatnonzero((number >= 0) & (number < network.subcarriers))
    if leakage_db is None and not len(whole):
        return None

    def data(symbol: str) -> np.ndarray:
        """Those of the "waveform", or of the symbols before and after, the "previous" and the "next waveform"."""
        result = np.zeros((network.symbols, network.subcarriers), np.complex128)
        if leakage_db is not None and len(whole) < network.subcarriers:
            noise = given.draws(f"leakage of {sends.name}, {symbol}").standard_normal((*result.shape, 2))
            result = 10 ** (-leakage_db / 20) * np.sqrt(0.5) * noise.view(np.complex128)[..., 0]
        if len(whole):
            result[:, whole] = given.aired(f"{symbol} of {sends.name}")[:, whole - first]
        return result

    return cache(data)


def _windowed(
    settings: dict, network: Network, response: np.ndarray, late_s: float, data: Callable[[str], np.ndarray]
) -> np.ndarray:
    """Time samples (N, M) of a response (N, M) in a receive window that this signal reaches `late_s` late."""
    samples = waveform.transmit(response, data("waveform"))
    count, rate_hz = network.subcarriers, network.subcarriers * network.subcarrier_spacing_hz
    before = int(np.clip(np.ceil((late_s - length_s(settings, network)) * rate_hz), 0, count))
    after, turned = int(np.clip(np.floor(-late_s * rate_hz), 0, count)), turn(settings, network)
    if before:
        samples[:, :before] = waveform.transmit(response * turned, data("previous waveform"))[:, :before]
    if after:
        rest = slice(count - after, None)
        samples[:, rest] = waveform.transmit(response * turned.conj(), data("next waveform"))[:, rest]
    return samples
