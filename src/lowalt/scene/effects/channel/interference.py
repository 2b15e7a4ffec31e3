"""Interference: the signals of other stations, with data unknown to the receiver.

They come from mast to mast and by the target.

A station hears every other station: its subcarriers at full level where sub-bands overlap
(`guard_subcarriers` below 0), and its leakage elsewhere. The receiver divides both by its own data,
which makes them noise: subcarriers of power |Y_m|^2 give every range cell a noise power of sum_m
|Y_m|^2 / M^2. All beams point at the same target. Symbols follow each other without a pause, so a
signal that is later than the cyclic prefix, or early by the error of a clock, contains part of
another symbol.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Station
from lowalt.files.errors import InputError
from lowalt.scene.chain import SceneSample
from lowalt.scene.checks import CheckedScene
from lowalt.scene.crossing import crossing
from lowalt.scene.laws.offsets import of_stations
from lowalt.scene.set_noise import white
from lowalt.scene.waveform import baseband_hz, windowed

SOURCE = (
    "3GPP TS 38.104, 6.6.3 (adjacent channel leakage ratio of base stations, 45 dB below 7 GHz; "
    "here the same at any distance in frequency); H. T. Friis 1946 (from mast to mast); M. Braun, "
    "OFDM Radar Algorithms in Mobile Communication Networks, KIT 2014, ch. 4 and 5 (other nodes as "
    "noise)"
)
DEFAULTS = {"leakage_db": 45.0, "loss_db": 0.0, "sigma_ppm": 0.017, "sigma_s": 2e-8}
UNMODELLED = ("links", "fmcw", "cw")


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a single station."""
    if len(scene.network.stations) < 2:
        raise InputError("effects.interference: the network has one station, expected at least two")


def arrivals(settings: dict, sample: SceneSample, sends: Station) -> list[tuple[np.ndarray, float]]:
    """Return both ways of a station's signal to the receiver, from mast to mast and by the target.

    A way is a pair: its response (N or 1, M) on the receiver's subcarriers, as if the sender used
    all of them, and its delay (s).
    """
    view = sample.view
    hears = view.station
    there = replace(sends, frequency_hz=hears.frequency_hz)
    name = f"{sends.name}-{hears.name}"
    seen = view.of(replace(hears, name=name, transmitter=there, receiver=hears))
    direct, delay_s = crossing(view, there, hears)
    by_target_s = float(seen.ways_m(view.origin_m)) / SPEED_OF_LIGHT
    return [
        (direct[None] * 10 ** (-settings["loss_db"] / 20), delay_s),
        (sample.direct_echo(seen), by_target_s),
    ]


def heard(settings: dict, sample: SceneSample) -> np.ndarray:
    """Return the time samples (N, M) of all other stations' signals.

    Data and leakage are drawn per receiver; errors of clocks and oscillators are drawn per look.
    """
    view = sample.view
    network = view.network
    total = np.zeros((network.symbols, network.subcarriers), np.complex128)
    errors = of_stations(settings, network, sample.scene.stream("link_offset", view.row))
    step_hz = network.subcarrier_spacing_hz
    middle = network.subcarriers // 2
    count = network.subcarriers
    number = np.arange(count)
    rate_hz = count * step_hz
    for sends in network.stations:
        if sends.name == view.station.name:
            continue
        ppm, shift_s = np.subtract(errors[sends.name], errors[view.station.name])
        ramp = np.exp(-2j * np.pi * baseband_hz(network) * shift_s)
        data = sent(settings, sample, sends)
        samples = np.zeros_like(total)
        for response, delay_s in arrivals(settings, sample, sends):
            late_s = delay_s + shift_s
            # Samples of the next symbol where the signal is early, below 0, and of the previous one
            # where it is later than the prefix.
            early = min(np.ceil(late_s * rate_hz), 0)
            beyond = max(np.ceil((late_s - sample.prefix_s) * rate_hz), 0)
            late = int(np.clip(early + beyond, -count, count))
            samples += windowed(network, sample.prefix_s, response * ramp, late, data)
        turn_hz = 1e-6 * ppm * (view.station.frequency_hz + middle * step_hz)
        within = np.exp(2j * np.pi * turn_hz * number / rate_hz)
        total += samples * within * np.exp(2j * np.pi * turn_hz * view.times_s)[:, None]
    return total


def sent(settings: dict, sample: SceneSample, sends: Station) -> Callable[[str], np.ndarray]:
    """Return a station's data (N, M) on the receiver's subcarriers, by their symbols' name.

    Where sub-bands overlap they are its subcarriers, elsewhere its leakage, which is noise.
    """
    network = sample.view.network
    apart_hz = sends.frequency_hz - sample.view.station.frequency_hz
    first = round(apart_hz / network.subcarrier_spacing_hz)
    number = np.arange(network.subcarriers) - first
    whole = np.flatnonzero((number >= 0) & (number < network.subcarriers))

    def data(symbol: str) -> np.ndarray:
        """Return the data of the "waveform", or of the "previous" or the "next waveform".

        These are of the symbols before and after.
        """
        result = np.zeros((network.symbols, network.subcarriers), np.complex128)
        if len(whole) < network.subcarriers:
            rng = sample.draws(f"leakage of {sends.name}, {symbol}")
            power = 10 ** (-settings["leakage_db"] / 10)
            result = white(rng, power, result.shape)
        if len(whole):
            aired = sample.on_air(f"{symbol} of {sends.name}")
            assert aired is not None  # every symbol of OFDM has data
            result[:, whole] = aired[:, whole - first]
        return result

    return cache(data)
