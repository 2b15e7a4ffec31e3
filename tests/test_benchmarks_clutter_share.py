"""The kept table of the land's share from close to the mast is that of the code, and isotropic elements dominate it."""

import csv
import sys
from pathlib import Path

import pytest

from lowalt.common.config import load

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))
import clutter_share  # noqa: E402


def test_isotropic_elements_let_the_masts_foot_dominate_and_the_standards_element_does_not():
    config = load([ROOT / "config/default.yaml"], ROOT / "workflow/schemas/config.schema.yaml")
    config["targets"]["table"] = str(ROOT / config["targets"]["table"])
    config["targets"]["records"] = [str(ROOT / path) for path in config["targets"]["records"]]
    aims = clutter_share.aims(config, 60)["UAV"]
    with (ROOT / "results/benchmarks/clutter_share.csv").open() as file:
        kept = {row["elements"]: row for row in csv.DictReader(file) if row["category"] == "UAV"}
    network = clutter_share.Network.from_settings(config["network"])
    for name, element in clutter_share.ELEMENTS.items():
        close, whole = map(sum, zip(*(clutter_share.near(network, aim, element) for aim in aims), strict=True))
        assert close / whole == pytest.approx(float(kept[name]["share_of_all"]), abs=2e-3)
    shares = [float(kept[name]["share_of_all"]) for name in clutter_share.ELEMENTS]
    assert shares[0] > 0.94 and max(shares[1:]) < 0.3
