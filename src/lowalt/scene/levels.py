"""The levels of one sample at one station, as a link budget lists them: watts and gains in decibels.

Powers are those of one subcarrier, or of one sample of an FMCW sweep, as the echo's amplitudes are. A range cell is the
mean of M of them, so an echo keeps its level in its cell, while noise falls by 10 lg M.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.motion.cross_section import mean_cross_section
from lowalt.scene import antenna, land
from lowalt.scene.effects import NamedEffect
from lowalt.scene.view import View
from lowalt.scene.waveform import prefix_length_s


class Level(NamedTuple):
    """One line of the table: its value, and the unit it is in (dBm, dB, dBi, dBsm)."""

    name: str
    value: float
    unit: str


def decibels(ratio: float) -> float:
    """Return a ratio of powers in dB, -inf for none."""
    return 10 * math.log10(ratio) if ratio > 0 else -math.inf


def dbm(power_w: float) -> float:
    """Return a power in dBm, -inf for none."""
    return decibels(power_w) + 30


def levels(view: View, effects: Sequence[NamedEffect], echo_w: float) -> list[Level]:
    """Return the levels of a sample.

    view: the sample, with the cross sections that the scene gives; effects: the scene's; echo_w: mean |Y_bin|^2 of the
    target's echo as it arrives (W). The expected echo is the mean over aspects and motion in mid-beam and in the middle
    of a range cell.
    Source: radar equation, spec: alpha and a0; Skolnik, Introduction to Radar Systems, 3rd ed. 2001, ch. 1.
    """
    network, link = view.network, view.station.transmitter is not None
    wavelength_m = SPEED_OF_LIGHT / network.carrier_hz
    out_m, back_m = (float(np.linalg.norm(view.origin_m - mast_m)) for mast_m in view.masts_m)
    ends = {"toward the target, each way": view.station}
    if link:
        ends = {"of the sender": view.station.transmitter, "of the receiver": view.station}
    gains = [1.0 if view.element is None else float(antenna.gain(view.element, end, view.origin_m))
             for end in ends.values()]  # fmt: skip
    budget = [
        Level(f"transmit power, {_one(view)}", dbm(network.power), "dBm"),
        Level("transmit array", decibels(math.prod(network.transmit)), "dB"),
        Level("receive array", decibels(math.prod(network.receive)), "dB"),
        *(Level(f"element {name}", decibels(gain), "dBi") for name, gain in zip(ends, gains, strict=True)),
        Level(f"path, {out_m:.1f} m and {back_m:.1f} m, 1 m2" if link else f"path out and back, {out_m:.1f} m, 1 m2",
              decibels(wavelength_m**2 / ((4 * math.pi) ** 3 * out_m**2 * back_m**2)), "dB"),
        Level("mean cross section", decibels(mean_cross_section(view.cloud, wavelength_m)), "dBsm"),
    ]  # fmt: skip
    # A station's element counts twice.
    expected_dbm = sum(level.value for level in budget) + (0.0 if link else decibels(gains[0]))
    whole = Level(f"transmit power, {network.subcarriers} subcarriers", dbm(network.power * network.subcarriers), "dBm")
    return [
        *([whole] if network.waveform == "ofdm" else []),
        *budget,
        Level("expected echo", expected_dbm, "dBm"),
        Level("echo of this sample, mean |Y_bin|^2", dbm(echo_w), "dBm"),
        *_beside(view, {effect.name: effect for effect in effects}, 0.5 * (out_m + back_m), expected_dbm),
    ]


def _one(view: View) -> str:
    """What the echo's amplitudes are those of."""
    return "one subcarrier" if view.network.waveform == "ofdm" else "one sample"


def _beside(view: View, effects: dict[str, NamedEffect], range_m: float, expected_dbm: float) -> list[Level]:
    """Levels of what a scene adds to the target's echo, and the noise."""
    network, result = view.network, []
    if "cyclic_prefix" in effects:
        effect = effects["cyclic_prefix"]
        prefix_s = prefix_length_s(effect.settings["prefix_s"], network)
        kept = 1 - float(effect.module.lost(2 * range_m / SPEED_OF_LIGHT, prefix_s, network))
        result.append(Level("loss beyond the cyclic prefix", 2 * decibels(kept), "dB"))
    if "clutter" in effects:
        power, _ = effects["clutter"].module.mean_power(effects["clutter"].settings, view)
        cell = round(range_m / network.cell_m) % network.subcarriers
        there = land.with_side_lobes(power, network.subcarriers)[cell]
        result.append(Level("land, all range cells", dbm(float(power.sum())), "dBm"))
        result.append(Level("land, the target's range cell", dbm(float(there)), "dBm"))
    if "background_channel" in effects:
        effect = effects["background_channel"]
        usual_w = effect.module.usual_power(effect.settings, view)
        result.append(Level(f"background, {_one(view)}, median of draws", dbm(usual_w), "dBm"))
    if view.station.transmitter is not None and "direct_path" in effects:
        direct = effects["direct_path"].module.scatter(effects["direct_path"].settings, view, None)
        result.append(Level(f"direct path, {_one(view)}", dbm(float(np.mean(abs(direct.response) ** 2))), "dBm"))
    if "transmit_leakage" in effects:
        leaked_dbm = dbm(network.power) - effects["transmit_leakage"].settings["isolation_db"]
        result.append(Level(f"transmit leakage, {_one(view)}", leaked_dbm, "dBm"))
    if "receiver_noise" in effects:
        effect = effects["receiver_noise"]
        noise_dbm = dbm(effect.module.variance(effect.settings, network.noise_bandwidth_hz))
        cell_dbm = noise_dbm - decibels(network.subcarriers)
        result += [
            Level(f"noise, {_one(view)}", noise_dbm, "dBm"),
            Level("noise, one range cell", cell_dbm, "dBm"),
            Level("expected echo over noise, in a range cell", expected_dbm - cell_dbm, "dB"),
        ]
    return result


def table(lines: Sequence[Level]) -> list[str]:
    """Return the levels as aligned lines of text."""
    width = max(len(level.name) for level in lines)
    return [f"{level.name:<{width}} {level.value:8.1f} {level.unit}" for level in lines]
