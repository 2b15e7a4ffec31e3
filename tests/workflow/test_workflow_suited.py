"""Region, speeds, schemes and named files that do not suit a configuration are refused before any job."""

import pytest

from configured import run_of
from lowalt.files.errors import InputError

ALONE = {"stations": {"B": None, "C": None}}
CORNERS = {"region": {"polygon_m": [[0, 0], [500, 0], [250, 433]]}}
A = "A:VRP+TRP+VT"


def recognition(**block) -> dict:
    """An overlay of the block `recognition`."""
    return {"recognition": block}


@pytest.mark.parametrize(
    "overlay",
    [
        {"network": ALONE, "motion": CORNERS, **recognition(schemes=[A])},
        {"network": {"carrier_hz": "28e9"}, "spectra": {"vt": {"speed_min_mps": -1.0, "speed_max_mps": 1.0}}},
        {"network": {"carrier_hz": 28e9}, "spectra": {"vt": None}, **recognition(schemes=["A:VRP"])},
        # Only the width of the axis counts, and symbols at known uneven instants tell more speeds apart.
        {"spectra": {"vt": {"speed_min_mps": 0.0, "speed_max_mps": 12.2}}},
        {"spectra": {"vt": {"speed_max_mps": 20.0}, "times": "known"}},
    ],
)
def test_what_suits_is_taken(overlay):
    assert run_of(overlay).schemes


@pytest.mark.parametrize(
    ("overlay", "words"),
    [
        ({"network": ALONE}, r"motion.region.polygon_m: None, the area between the stations, .* \[\[0.0, 0.0\]\]; exp"),
        (
            {"motion": {"region": {"polygon_m": [[0, 0], [1, 1]]}}},
            r"polygon_m: \[\[0, 0\], \[1, 1\]\]; expected corners",
        ),
        ({"motion": {"region": {"polygon_m": []}}}, r"polygon_m: \[\]; expected corners"),
        ({"network": ALONE, "motion": CORNERS}, "recognition.schemes: 'ABC:.* line 8: stations 'ABC', .* has .*'A:VT'"),
        ({"spectra": {"vt": None}}, r"recognition.schemes: 'A:.* needs \['vt'\]; .* has \['A:VRP', 'A:TRP'\]"),
        (recognition(schemes=["x"]), r"recognition.schemes: 'x': .* which has [^;]*$"),
        (recognition(timed=["x"]), "recognition.timed: 'x'"),
        (recognition(schemes=[A, "a-vrp-trp-vt"]), "expected every scheme once"),
        (recognition(schemes=["ABC:mean fusion"], protocols=["seen"]), r"recognition.protocols: .* gives \['unseen'\]"),
        (
            {"network": {"carrier_hz": 28e9, "symbol_interval_s": 1e-3}},
            r"speed_max_mps 6.1, .* to 2.68: .* 2.8e\+10 .* 0.001",
        ),
        ({"spectra": {"vt": {"speed_step_mps": 1e-6}}}, "spectra.vt: .* expected a step that makes at most 65536"),
        ({"spectra": {"trp": {"window": 9}}}, "spectra.trp: window is 9"),
        ({"network": {"guard_subcarriers": -3}}, "expected effects.interference"),
        ({"inputs": "none"}, "inputs: 'none' is not there"),
        (recognition(network={"weights": "a.pth"}), "recognition.network.weights: 'a.pth' is not there"),
        (recognition(network={"backbone": "a.py:f"}), "recognition.network.backbone: 'a.py' is not there"),
        (recognition(table="a.csv"), "recognition.table: 'a.csv' is not there"),
        ({"report": {"accuracy": "a.csv"}}, "report.accuracy: 'a.csv' is not there"),
        ({"targets": {"select": ["crow"]}}, r"targets.select: \['crow'\], expected perhaps \['Crow'\]$"),
    ],
)
def test_what_does_not_is_refused_with_its_key_and_what_was_expected(overlay, words):
    with pytest.raises(InputError, match=words) as refused:
        run_of(overlay)
    assert "\n" not in str(refused.value)
