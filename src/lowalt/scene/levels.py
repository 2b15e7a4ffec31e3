"""The levels of one sample at one station, as a link budget lists them.

They are watts and gains in decibels.

Powers are those of one subcarrier, or of one sample of an FMCW sweep, as the echo's amplitudes are.
A range cell is the mean of M of them, so an echo keeps its level in its cell, while noise falls by
10 lg M.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.motion.cross_section import mean_cross_section
from lowalt.numerics.portable import norm
from lowalt.scene import antenna
from lowalt.scene.effects import NamedEffect, every, only
from lowalt.scene.view import View


class Level(NamedTuple):
    """One line of the table: its value, and the unit it is in (dBm, dB, dBi, dBsm)."""

    name: str
    value: float
    unit: str


def decibels(ratio: float) -> float:
    """Return a ratio of powers in dB, -inf for none."""
    if ratio <= 0:
        return -math.inf
    return 10 * math.log10(ratio)


def dbm(power_w: float) -> float:
    """Return a power in dBm, -inf for none."""
    return decibels(power_w) + 30


def levels(view: View, effects: Sequence[NamedEffect], echo_w: float) -> list[Level]:
    """Return the levels of a sample.

    view: the sample, with the cross sections that the scene gives; effects: the scene's; echo_w:
    mean |Y_bin|^2 of the target's echo as it arrives (W). The expected echo is the mean over
    aspects and motion in mid-beam and in the middle of a range cell.
    Source: radar equation, spec: alpha and a0; Skolnik, Introduction to Radar Systems, 3rd ed.
    2001, ch. 1.
    """
    network = view.network
    sender = view.station.transmitter
    wavelength_m = SPEED_OF_LIGHT / network.carrier_hz
    sender_m, receiver_m = view.masts_m
    out_m = float(norm(view.origin_m - sender_m))
    back_m = float(norm(view.origin_m - receiver_m))
    path = f"path out and back, {out_m:.1f} m, 1 m2"
    ends = {"toward the target, each way": view.station}
    if sender is not None:
        path = f"path, {out_m:.1f} m and {back_m:.1f} m, 1 m2"
        ends = {"of the sender": sender, "of the receiver": view.station}
    gains_db = {}
    for name, end in ends.items():
        gains_db[name] = 0.0
        if view.element is not None:
            gains_db[name] = decibels(float(antenna.gain(view.element, end, view.origin_m)))
    path_db = decibels(wavelength_m**2 / ((4 * math.pi) ** 3 * out_m**2 * back_m**2))
    cross_section_db = decibels(mean_cross_section(view.cloud, wavelength_m))
    budget = [
        Level(f"transmit power, {network.bin_name}", dbm(network.power), "dBm"),
        Level("transmit array", decibels(math.prod(network.transmit)), "dB"),
        Level("receive array", decibels(math.prod(network.receive)), "dB"),
        *(Level(f"element {name}", gain_db, "dBi") for name, gain_db in gains_db.items()),
        Level(path, path_db, "dB"),
        Level("mean cross section", cross_section_db, "dBsm"),
    ]
    expected_dbm = sum(level.value for level in budget)
    if sender is None:
        # A station's element counts twice.
        expected_dbm += sum(gains_db.values())
    lines = [
        *budget,
        Level("expected echo", expected_dbm, "dBm"),
        Level("echo of this sample, mean |Y_bin|^2", dbm(echo_w), "dBm"),
        *_beside(view, effects, expected_dbm),
    ]
    if network.waveform == "ofdm":
        whole_dbm = dbm(network.power * network.subcarriers)
        lines.insert(
            0, Level(f"transmit power, {network.subcarriers} subcarriers", whole_dbm, "dBm")
        )
    return lines


def _beside(view: View, effects: Sequence[NamedEffect], expected_dbm: float) -> list[Level]:
    """Levels of what a scene adds to the target's echo, and the noise."""
    network = view.network
    result = []
    for lines in every(effects, "levels").values():
        for name, value, unit in lines(view):
            if unit == "W":
                result.append(Level(name, dbm(value), "dBm"))
            else:
                result.append(Level(name, decibels(value), "dB"))
    if noise_w := only(effects, "noise_w"):
        noise_dbm = dbm(noise_w(network))
        cell_dbm = noise_dbm - decibels(network.subcarriers)
        result += [
            Level(f"noise, {network.bin_name}", noise_dbm, "dBm"),
            Level("noise, one range cell", cell_dbm, "dBm"),
            Level("expected echo over noise, in a range cell", expected_dbm - cell_dbm, "dB"),
        ]
    return result


def table(lines: Sequence[Level]) -> list[str]:
    """Return the levels as aligned lines of text."""
    width = max(len(level.name) for level in lines)
    return [f"{level.name:<{width}} {level.value:8.1f} {level.unit}" for level in lines]
