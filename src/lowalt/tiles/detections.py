"""Detections of a look: what stands out of its range-Doppler map at a constant false-alarm rate, beside the truth."""

import numpy as np
from scipy.ndimage import maximum_filter

from lowalt.config.network import Network, Station
from lowalt.scene.effects.detection.detector import DEFAULTS, check_threshold, exceeds, windowed
from lowalt.spectra.cube import TRUTH, Cube
from lowalt.spectra.kinds import range_doppler

DETECTION = np.dtype([("cell", "<i8"), ("range_m", "<f8"), ("radial_mps", "<f8"), ("over_db", "<f8"), ("true", "?")])
"""Range cell, its range within the band's unambiguous one, folded speed away from the station, power over the mean of
the map, and whether it is the target's."""


def detections(
    cube: Cube, network: Network, station: Station, false_alarm: float = 1e-4, guard: int = 2, training: int = 16,
    cfar: str = "cell_averaging", range_window: str = "none",
) -> np.ndarray:  # fmt: skip
    """Return the detections (`DETECTION`) of a cube, the strongest first.

    A value of the range-Doppler map is detected where it is the largest of its neighbours and exceeds its threshold,
    which noise passes with probability `false_alarm`; `guard`, `training`, `cfar` and `range_window` are those of the
    effect `detector`.
    It is the target's where it is within one cell and two speeds of the observed truth at some symbol; for a
    companion give `cube._replace(truth=cube.others[0])`.
    Raises: InputError for an unknown name, or for fewer than two guard cells with range_window "hann".
    Source: Finn & Johnson 1968; Rohling 1983; Richards 2014, 6.5.
    """
    symbols, count = cube.cells.shape
    settings = range_doppler.Settings(count - 1 + count % 2, symbols)
    rule = DEFAULTS | {
        "false_alarm": false_alarm, "guard": guard, "training": training, "cfar": cfar, "range_window": range_window,
    }  # fmt: skip
    check_threshold(rule)
    power = range_doppler.definition(cube._replace(cells=windowed(rule, cube.cells)), settings) ** 2
    passed = exceeds(rule, power.T).T
    rows, columns = np.nonzero(passed & (power == maximum_filter(power, 3, mode="wrap")))
    result = np.zeros(len(rows), DETECTION)
    result["cell"] = (cube.chosen[symbols // 2] - settings.cells // 2 + rows) % count
    result["range_m"] = result["cell"] * network.cell_m
    result["radial_mps"] = network.bin_speeds_mps(symbols, station)[columns]
    result["over_db"] = 10 * np.log10(power[rows, columns] / power.mean())
    true = dict(zip(TRUTH, cube.truth.T, strict=True))
    aside = (result["cell"][:, None] - true["observed_cell"] + count / 2) % count - count / 2
    faster = network.folded_mps(result["radial_mps"][:, None] - true["observed_mps"], station)
    step = 2 * network.largest_mps(station) / symbols
    result["true"] = ((abs(aside) <= 1) & (abs(faster) <= 2 * step) & (true["cell"] >= 0)).any(axis=1)
    return result[np.argsort(-result["over_db"])]
