"""The levels of one sample at one station, as a link budget lists them: watts and gains in decibels.

Powers are those of one subcarrier, as the echo's amplitudes are. A range cell is the mean of M subcarriers, so an echo
keeps its level in its cell, while noise falls by 10 lg M.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.motion.cross_section import mean_cross_section
from lowalt.scene import antenna, land
from lowalt.scene.catalogue import NamedEffect
from lowalt.scene.view import View


class Level(NamedTuple):
    """One line of the table: its value, and the unit it is in (dBm, dB, dBi, dBsm)."""

    name: str
    value: float
    unit: str


def dbm(power_w: float) -> float:
    """Return a power in dBm, -inf for none."""
    return 10 * math.log10(power_w) + 30 if power_w > 0 else -math.inf


def levels(view: View, effects: dict[str, NamedEffect], echo_w: float) -> list[Level]:
    """Return the levels of a sample.

    view: the sample, with the cross sections that the scene gives; effects: the scene's, by name; echo_w: mean
    |Y_bin|^2 of the target's echo as it arrives (W). The expected echo is the mean over aspects and motion in mid-beam
    and in the middle of a range cell.
    Source: radar equation, spec: alpha and a0; Skolnik, Introduction to Radar Systems, 3rd ed. 2001, ch. 1.
    """
    network, station = view.network, view.station
    sender = station.transmitter or station
    out, back = (float(np.linalg.norm(view.origin_m - np.asarray(end.position_m))) for end in (sender, station))
    range_m, sent = 0.5 * (out + back), dbm(network.power)
    arrays = [10 * math.log10(math.prod(shape)) for shape in (network.transmit, network.receive)]
    elements = _elements(view)
    expected = expected_dbm(view)
    ways = f"path out and back, {out:.1f} m, 1 m2" if sender is station else f"path, {out:.1f} m and {back:.1f} m, 1 m2"
    result = [
        Level(f"transmit power, {network.subcarriers} subcarriers", dbm(network.power * network.subcarriers), "dBm"),
        Level("transmit power, one subcarrier", sent, "dBm"),
        Level("transmit array", arrays[0], "dB"),
        Level("receive array", arrays[1], "dB"),
        *elements,
        Level(ways, path_db(view), "dB"),
        Level("mean cross section", section_dbsm(view), "dBsm"),
        Level("expected echo", expected, "dBm"),
        Level("echo of this sample, mean |Y_bin|^2", dbm(echo_w), "dBm"),
    ]
    if "cyclic_prefix" in effects:
        cut = effects["cyclic_prefix"]
        prefix = cut.module.length_s(cut.settings, network)
        lost = float(cut.module.lost(2 * range_m / SPEED_OF_LIGHT, prefix, network))
        kept = 20 * math.log10(1 - lost) if lost < 1 else -math.inf
        result.append(Level("loss beyond the cyclic prefix", kept, "dB"))
    if "clutter" in effects:
        result += _clutter(view, effects["clutter"], range_m)
    if "background_channel" in effects:
        around = effects["background_channel"]
        usual = dbm(around.module.usual_power(around.settings, view))
        result.append(Level("background, one subcarrier, median of draws", usual, "dBm"))
    if sender is not station and "direct_path" in effects:
        direct = effects["direct_path"].module.scatter(effects["direct_path"].settings, view, None)
        result.append(Level("direct path, one subcarrier", dbm(float(np.mean(abs(direct) ** 2))), "dBm"))
    if "transmit_leakage" in effects:
        leaked = sent - effects["transmit_leakage"].settings["isolation_db"]
        result.append(Level("transmit leakage, one subcarrier", leaked, "dBm"))
    if "receiver_noise" in effects:
        noisy = effects["receiver_noise"]
        noise = dbm(noisy.module.variance(noisy.settings, network.subcarrier_spacing_hz))
        cell = noise - 10 * math.log10(network.subcarriers)
        result += [
            Level("noise, one subcarrier", noise, "dBm"),
            Level("noise, one range cell", cell, "dBm"),
            Level("expected echo over noise, in a range cell", expected - cell, "dB"),
        ]
    return result


def expected_dbm(view: View) -> float:
    """Return the mean power (dBm) of a subcarrier's echo over aspects and motion, in mid-beam."""
    network, elements = view.network, _elements(view)
    arrays = sum(10 * math.log10(math.prod(shape)) for shape in (network.transmit, network.receive))
    both = 2 * elements[0].value if len(elements) == 1 else sum(level.value for level in elements)
    return dbm(network.power) + arrays + both + path_db(view) + section_dbsm(view)


def section_dbsm(view: View) -> float:
    """Return the target's mean cross section (dBsm) over aspects and motion."""
    return 10 * math.log10(mean_cross_section(view.cloud, SPEED_OF_LIGHT / view.network.carrier_hz))


def path_db(view: View) -> float:
    """Return the loss (dB, negative) of an echo of 1 m2 at the target's origin, from the sender to it and on."""
    ends = view.station.transmitter or view.station, view.station
    out, back = (float(np.linalg.norm(view.origin_m - np.asarray(end.position_m))) for end in ends)
    wavelength = SPEED_OF_LIGHT / view.network.carrier_hz
    return 10 * math.log10(wavelength**2 / ((4 * math.pi) ** 3 * out**2 * back**2))


def _elements(view: View) -> list[Level]:
    """The elements' gain toward the target: of a station, or of both ends of a link."""
    ends = {"toward the target, each way": view.station}
    if view.station.transmitter is not None:
        ends = {"of the sender": view.station.transmitter, "of the receiver": view.station}
    result = []
    for name, end in ends.items():
        gain = 1.0 if view.element is None else float(antenna.gain(view.element, end, view.origin_m))
        result.append(Level(f"element {name}", 10 * math.log10(gain), "dBi"))
    return result


def _clutter(view: View, effect: NamedEffect, range_m: float) -> list[Level]:
    """Mean levels of the land: all of it, and in the target's range cell."""
    power = effect.module.mean_power(effect.settings, view)
    count = view.network.subcarriers
    own = land.with_side_lobes(power, count)[round(range_m / view.network.cell_m) % count]
    return [
        Level("land, all range cells", dbm(float(power.sum())), "dBm"),
        Level("land, the target's range cell", dbm(float(own)), "dBm"),
    ]


def table(found: list[Level]) -> list[str]:
    """Return the levels as aligned lines of text."""
    width = max(len(level.name) for level in found)
    return [f"{level.name:<{width}} {level.value:8.1f} {level.unit}" for level in found]
