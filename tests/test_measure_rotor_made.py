"""Made signals of rotors (`lowalt.measure.rotor_made`) by a slow sum, and the rows that are read from them."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.common.csv_tables import read_csv
from lowalt.measure import rotor_made
from lowalt.measure.rotor_estimates import Read
from lowalt.recognition.rotor_blades import Blades

ROOT = Path(__file__).parent.parent


class Drawn:
    """A generator whose numbers come from a list, which notes what was asked for."""

    def __init__(self, seed=5):
        self.rng, self.asked, self.given = np.random.default_rng(seed), [], []

    def _noted(self, what, value):
        self.asked.append(what)
        self.given.append(value)
        return value

    def uniform(self, low, high, size=None):
        return self._noted((low, high, size), self.rng.uniform(low, high, size))

    def random(self, size):
        return self._noted(("random", size), self.rng.random(size))

    def standard_normal(self, size):
        return self._noted(("normal", size), self.rng.standard_normal(size))


def test_made_signals_are_a_body_and_blades_a_point_and_a_symbol_at_a_time():
    rng = Drawn()
    found = rotor_made.made(rng, 3, 5.0, 71.0, 2)
    assert found.shape == (3, 400) and rng.asked == [
        (0.1, 1.0, 11), (0, 2 * np.pi, 2), *[("random", 2), (-200, 200, None), ("normal", (400, 2))] * 3]  # fmt: skip
    radii, phases = [*rng.given[0], 1.0], rng.given[1]
    sums = np.zeros((2, 400), complex)
    for rotor, sense in ((0, 1), (1, -1)):
        for symbol in range(400):
            for blade in range(3):
                angle = sense * 2 * np.pi * 71.0 * symbol / 400 + phases[rotor] + 2 * np.pi * blade / 3
                sums[rotor, symbol] += sum(np.exp(5j * radius * np.cos(angle)) for radius in radii)
    for look, (turns, hertz, noise) in zip(found, zip(*(rng.given[2 + part :: 3] for part in range(3)), strict=True),
                                           strict=True):  # fmt: skip
        both = sum(np.exp(2j * np.pi * turn) * one for turn, one in zip(turns, sums, strict=True))
        clean = (3 + both / np.sqrt(np.mean(abs(both) ** 2))) * np.exp(2j * np.pi * hertz * np.arange(400) / 400)
        scale = np.sqrt(np.mean(abs(clean) ** 2) / 100 / 2)
        np.testing.assert_allclose(look, clean + scale * (noise[:, 0] + 1j * noise[:, 1]), rtol=1e-9)


def test_a_read_signal_has_its_truth_and_lines_drawn_about_what_is_asked_for(monkeypatch):
    rng, asked = Drawn(), []
    told = Blades(5.0, (4.0, 6.0), True, -0.9, 47.0)
    monkeypatch.setattr(rotor_made, "made", lambda *given: asked.append(given[1:]) or np.ones((3, 400)))
    monkeypatch.setattr(rotor_made, "without_body", lambda look, interval_s: look * interval_s)
    monkeypatch.setattr(
        rotor_made, "passing_of_rests", lambda rests, interval_s: SimpleNamespace(hertz=50.0, level=7.0)
    )

    def blades(rests, found, interval_s, wavelengths_m, sines):
        assert (rests == 2.5e-3).all() and interval_s == 2.5e-3 and sines.tolist() == [1, 1, 1]
        np.testing.assert_allclose(wavelengths_m, [4 * np.pi] * 3)
        return told

    monkeypatch.setattr(rotor_made, "blades", blades)
    found = rotor_made.read_made(rng, 3, 6, 4)
    assert rng.asked == [(0.85, 1.15, None), (60, 160, None)]
    lines, rate_hz = 6 * rng.given[0], rng.given[1]
    assert asked == [(3, lines * 3, rate_hz, 4)]
    away = abs(50.0 - abs((3 * rate_hz + 200) % 400 - 200))
    assert found[:1] == (pytest.approx(away),) and np.isnan(found[1]) and found[2:] == (7.0, told, lines)


def test_the_kept_table_of_made_rotors_has_the_kinds_that_the_command_makes(tmp_path, monkeypatch):
    rows = read_csv(ROOT / "results/reference/made-rotors.csv", *rotor_made.COLUMNS)
    kinds = [tuple(int(row[name]) for name in ("rotors", "blades", "lines")) for row in rows]
    assert kinds == list(rotor_made.KINDS)
    # One cycle a look of a second is one hertz; an error of just that is wrong.
    errors, asked = iter([0.999, 1.0, 0.5, 3.0]), []

    def read(rng, count, lines, rotors):
        asked.append((rng.random(), count, lines, rotors))
        return Read(next(errors), np.nan, 7.0, Blades(None, None, None, 0.0, 47.0), 1.0)

    monkeypatch.setattr(rotor_made, "read_made", read)
    monkeypatch.setattr(rotor_made, "KINDS", ((1, 2, 3), (4, 5, 6)))
    rotor_made.main(["--draws", "2", "--out", str(tmp_path / "made.csv")])
    first, second = read_csv(tmp_path / "made.csv", *rotor_made.COLUMNS)
    assert [one[1:] for one in asked] == [(2, 3, 1)] * 2 + [(5, 6, 4)] * 2 and len({one[0] for one in asked}) == 4
    assert (first["right_percent"], second["right_percent"], first["draws"]) == ("50.0", "50.0", "2")
    assert first["length_told_percent"] == "0.0" and first["parity_right"] == "0"
