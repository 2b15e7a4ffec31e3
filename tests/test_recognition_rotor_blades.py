"""Blade length and number of made rotors, read back from folded signals; null space pursuit parts what it should."""

import numpy as np
import pytest

from lowalt.common.streams import stream
from lowalt.measure import rotor_made
from lowalt.recognition import null_space_pursuit, rotor_blades
from lowalt.recognition.rotor import Passing, folded, passing, without_body, without_pursued_body
from test_recognition_features import INTERVAL_S, SYMBOLS, TIMES, body, noisy
from test_recognition_features import rotor as blades_of


def test_the_comb_of_a_single_point_has_bessel_s_amplitudes():
    from scipy.special import jv

    rest = np.exp(1j * 6.0 * np.cos(2 * np.pi * 47.3 * TIMES))
    lines = rotor_blades.comb(rest, 47.3, INTERVAL_S, 9)
    np.testing.assert_allclose(np.abs(lines), np.abs(jv(np.arange(-9, 10), 6.0)), atol=2e-3)


def test_folded_lines_that_meet_are_counted_as_not_resolved():
    # Lines 4 and -4 of a comb of 50 Hz fold onto each other at 400 symbols a second; 2 and -2 do not.
    assert rotor_blades.resolved_lines(50.0, SYMBOLS, INTERVAL_S) == 3
    assert rotor_blades.resolved_lines(200.0, SYMBOLS, INTERVAL_S) == 0


@pytest.mark.parametrize(("blades", "lines", "rate"), [(2, 6.4, 88.3), (3, 5.5, 57.7), (5, 4.6, 61.9)])
def test_length_over_blades_and_parity_of_one_rotor_are_read_back(blades, lines, rate, monkeypatch):
    rng = stream(3, "rotors", blades)
    looks = rotor_made.made(rng, blades, lines * blades, rate, rotors=1)
    rests = np.array([without_body(look, INTERVAL_S) for look in looks])
    found = Passing(float(folded(blades * rate, INTERVAL_S)), 50.0)
    told = rotor_blades.blades(rests, found, INTERVAL_S, np.full(3, 4 * np.pi), np.ones(3))
    assert told.length_over_count_m == pytest.approx(lines, rel=0.12)
    assert told.bounds_m[0] < lines < told.bounds_m[1]
    assert told.odd == (blades % 2 == 1) and abs(told.contrast) > 0.8
    # Seen under half the sine, the same comb is that of a blade twice as long.
    half = rotor_blades.blades(rests, found, INTERVAL_S, np.full(3, 4 * np.pi), np.full(3, 0.5))
    assert half.length_over_count_m == pytest.approx(2 * told.length_over_count_m)
    # A comb that hardly stands out, or that holds too little of the rest, tells nothing.
    weak = rotor_blades.blades(rests, found._replace(level=4.9), INTERVAL_S, np.full(3, 4 * np.pi), np.ones(3))
    monkeypatch.setattr(rotor_blades, "HELD", 1.1)
    little = rotor_blades.blades(rests, found, INTERVAL_S, np.full(3, 4 * np.pi), np.ones(3))
    assert weak.length_over_count_m is None and little.length_over_count_m is None


def test_the_share_that_a_comb_holds_is_that_of_its_lines_up_to_the_edge():
    rest = np.exp(1j * 6.0 * np.cos(2 * np.pi * 47.3 * TIMES)) + np.exp(2j * np.pi * 70.9 * TIMES)
    found = rotor_blades.comb(rest, 47.3, INTERVAL_S, 9)
    assert rotor_blades.held_share(rest[None], [found], [9]) == pytest.approx(0.5, abs=0.03)
    assert rotor_blades.held_share(rest[None], [found], [3]) < 0.3


def test_nothing_is_told_of_noise_or_of_lines_that_meet():
    rests = np.array([noisy(np.zeros(SYMBOLS) + 1e-9, -60, seed) for seed in range(3)])
    for hertz, level in ((97.3, 50.0), (97.3, 2.0), (100.0, 50.0)):
        told = rotor_blades.blades(rests, Passing(hertz, level), INTERVAL_S, np.full(3, 0.06), np.ones(3))
        assert told.length_over_count_m is None and told.odd is None


def test_second_differences_and_the_operator_s_bands_are_those_of_their_matrices():
    difference = np.diff(np.eye(9), 2, axis=0)
    bands = null_space_pursuit.second_difference_bands(9)
    for step in range(3):
        np.testing.assert_array_equal(bands[step, : 9 - step], np.diagonal(difference.T @ difference, -step))
    course = np.exp(1j * np.linspace(0, 2, 8)) * 0.9
    operator = np.eye(9, dtype=complex)[1:] - course[:, None] * np.eye(9)[:-1]
    values = np.exp(1j * np.arange(9.0) ** 2)
    expected = operator.conj().T @ operator @ values + 0.3 * values
    np.testing.assert_allclose(null_space_pursuit._applied(course, values) + 0.3 * values, expected, atol=1e-12)
    np.testing.assert_allclose(null_space_pursuit._solver(course, 0.3)(expected), values, atol=1e-12)


def test_pursuit_parts_a_body_that_changes_amplitude_and_speed_from_a_rotor():
    course = np.exp(2j * np.pi * (37 * TIMES + 9 * TIMES**2)) * (1 + 0.3 * np.cos(2 * np.pi * 1.3 * TIMES))
    turning = 0.2 * np.exp(2j * np.pi * 127 * TIMES)
    found = null_space_pursuit.pursue(course + turning, 38.0, INTERVAL_S)
    assert np.linalg.norm(found.component - course) < 0.1 * np.linalg.norm(course)
    assert np.linalg.norm(found.rest - turning) < 0.5 * np.linalg.norm(turning)
    assert found.rounds < 30 and found.leakage > 0
    looks = [noisy(body(speed) * (1 + np.exp(1j) * blades_of(88.0, 2, 5.0)), 18) for speed in (-3.0, 1.0, 4.5)]
    assert passing(np.array(looks), INTERVAL_S, without_pursued_body).hertz == pytest.approx(176, abs=0.3)


def test_the_table_of_made_rotors_has_the_truth_in_its_rows(tmp_path, monkeypatch):
    monkeypatch.setattr(rotor_made, "KINDS", ((1, 3, 6),))
    rotor_made.main(["--draws", "2", "--out", str(tmp_path / "made.csv")])
    header, row = ((tmp_path / "made.csv").read_text().splitlines())[:2]
    assert header.split(",") == list(rotor_made.COLUMNS)
    assert row.split(",")[:4] == ["1", "3", "6", "2"]


GOLDEN_HZ = 200 * (3 - np.sqrt(5))
"""The passing frequency whose folded lines stay farthest apart."""


def slow_resolved(turns, symbols, most):
    """The largest K for which no two of the folded lines -K..K are closer than 2.5 cycles a look."""
    told = 0
    for last in range(1, most + 1):
        places = [(turns * line) % 1 for line in range(-last, last + 1)]
        apart = [abs(a - b) for number, a in enumerate(places) for b in places[:number]]
        if min(min(one, 1 - one) for one in apart) * symbols < 2.5:
            break
        told = last
    return told


def test_resolved_lines_are_those_of_all_pairs():
    for number, hertz in enumerate(stream(5, "rates").uniform(1, 199, 6)):
        symbols = (400, 700)[number % 2]
        found = rotor_blades.resolved_lines(hertz, symbols, INTERVAL_S)
        assert found == slow_resolved(hertz * INTERVAL_S, symbols, 80)
    # At the golden ratio lines stay apart for long: at 4000 symbols all eighty, at 40 000 as many as asked for.
    assert rotor_blades.resolved_lines(GOLDEN_HZ, 4000, INTERVAL_S) == 80
    assert rotor_blades.resolved_lines(GOLDEN_HZ, 40_000, INTERVAL_S, 31) == 31
    # A line of exactly 2.5 cycles from the body is told apart.
    assert rotor_blades.resolved_lines(2.5, 400, INTERVAL_S, 3) == 3


def test_a_refined_frequency_stays_within_a_fifth_of_a_cycle_at_each_search_s_last_line():
    """A comb of equal lines. Searches are over 4 lines, then half as many more; each tries 11 rates."""
    rest = sum(np.exp(2j * np.pi * GOLDEN_HZ * line * TIMES) for line in range(-12, 13))[None]
    look_s = SYMBOLS * INTERVAL_S
    for most, spans in ((3, (3,)), (4, (4,)), (5, (4, 5)), (8, (4, 6, 8)), (9, (4, 6, 9)), (12, (4, 6, 9, 12))):
        first, reach = 0.2 / (spans[0] * look_s), sum(0.2 / (last * look_s) for last in spans)
        # From two steps away the first search ends at the truth; from farther off each search goes as far as it can.
        for start, left in ((0.4 * first, 0), (-0.4 * first, 0), (reach, 0), (1.5 * reach, 0.5 * reach)):
            found = rotor_blades.refined(rest, GOLDEN_HZ + start, INTERVAL_S, most)
            assert found == pytest.approx(GOLDEN_HZ + left, abs=1e-9)


def test_faint_lines_do_not_refine_a_frequency():
    """Four strong lines, and two of less or more than 15 % of their power, of a comb that turns a little faster."""
    look_s = SYMBOLS * INTERVAL_S
    faster = GOLDEN_HZ + 0.16 / (6 * look_s)
    strong = sum(np.exp(2j * np.pi * GOLDEN_HZ * line * TIMES) for line in range(-4, 5))
    others = sum(np.exp(2j * np.pi * faster * line * TIMES) for line in (-6, -5, 5, 6))
    found = [
        rotor_blades.refined((strong + np.sqrt(share) * others)[None], GOLDEN_HZ, INTERVAL_S, 6)
        for share in (0.13, 0.17)
    ]
    assert found[0] == pytest.approx(GOLDEN_HZ, abs=1e-9) and found[1] > GOLDEN_HZ + 0.03 / (6 * look_s)


def test_levels_of_lines_are_both_sides_together_and_none_is_18_db_below_the_strongest():
    sides = np.array([0.01j, 3, 1, 2j, 4, 0, 7, 0, 1, 1j, -2, 0, 0.01])
    # Lines 1 to 6: 0, 16 + 1, 4 + 1, 1 + 4, 9, 1e-4 + 1e-4; the mean of the four strongest is 9.
    floor = 9 * 10**-1.8
    np.testing.assert_allclose(rotor_blades.line_levels(sides), [floor, 17, 5, 5, 9, floor], rtol=1e-9)
    assert (rotor_blades.line_levels(np.zeros(5, complex)) == 1e-300).all()


def test_the_cost_of_an_edge_is_the_negative_log_likelihood_of_two_exponential_powers():
    """Two complex normal values a line, whose power has the density p / m^2 exp(-p / m)."""
    levels = np.array([5.0, 3.0, 0.4, 0.2, 0.6])
    costs = []
    for edge in range(6):
        parts = [part for part in (levels[:edge], levels[edge:]) if len(part)]
        costs.append(sum(2 * len(part) * np.log(part.mean()) for part in parts))
    np.testing.assert_allclose(rotor_blades.edge_costs(levels), costs, rtol=1e-12)


def slow_length(levels, line_m):
    """The length of least cost over all stations and its bounds, a length and a station at a time; None: not told."""
    reach, costs, lengths = len(levels[0]), [], []
    for number in range(400):
        first, last = 0.8 * min(line_m), reach * max(line_m)
        length = first * (last / first) ** (number / 399)
        cost = inner = outer = 0.0
        for power, step in zip(levels, line_m, strict=True):
            edge = min(int(length / step), reach)
            cost += rotor_blades.edge_costs(power)[edge]
            inner += power[:edge].sum() / power.mean() / max(edge, 1)
            outer += power[edge:].sum() / power.mean() / max(reach - edge, 1)
        if inner >= 10**0.9 * outer:
            costs.append(cost)
            lengths.append(length)
    if not costs or sum(rotor_blades.edge_costs(power)[-1] for power in levels) - min(costs) < 20:
        return None
    likely = [length for length, cost in zip(lengths, costs, strict=True) if cost <= min(costs) + 2]
    step = np.mean(line_m)

    def less(length, share):
        return max(length - share * step * np.cbrt(length / step), 0)

    middle = less(np.sqrt(likely[0] * likely[-1]), 0.15)
    return middle, (less(likely[0], 0.65), less(likely[-1], -0.35))


def test_the_length_of_blades_is_that_of_the_slow_search():
    rng, told = stream(9, "levels"), []
    for number in range(15):
        line_m, reach = rng.uniform(0.9, 1.1, 1 + number % 3), int(rng.integers(3, 25))
        edge, depth = rng.uniform(0.5, 1.2 * reach), 10 ** rng.uniform(-3, -0.5)
        levels = [
            np.where(np.arange(1, reach + 1) <= edge / step, 1.0, depth) * rng.gamma(0.5, 2.0, reach) for step in line_m
        ]
        found, wanted = rotor_blades.length_of(levels, line_m), slow_length(levels, line_m)
        told.append(wanted is not None)
        assert (found is None) == (wanted is None)
        if wanted:
            assert found[0] == pytest.approx(wanted[0], rel=1e-9)
            assert found[1] == (pytest.approx(wanted[1][0], rel=1e-9), pytest.approx(wanted[1][1], rel=1e-9))
    assert 3 < sum(told) < 13


def test_the_contrast_of_sides_is_that_of_alternating_products():
    """Lines k and -k have products p_k; only lines up to each comb's edge count, weighed by the root of their size."""
    rng = stream(7, "sides")
    combs = [rng.standard_normal((2 * most + 1, 2)) @ [1, 1j] for most in (4, 6)]
    even = odd = whole = 0.0
    for comb, most, edge in zip(combs, (4, 6), (3, 6), strict=True):
        products = [comb[most + line] * comb[most - line] for line in range(1, edge + 1)]
        scaled = [product / np.sqrt(abs(product)) for product in products]
        even += abs(sum(scaled)) ** 2
        odd += abs(sum((-1) ** line * one for line, one in enumerate(scaled, 1))) ** 2
        whole += sum(abs(one) for one in scaled) ** 2
    assert rotor_blades.contrast_of(combs, [3, 6]) == pytest.approx((even - odd) / whole, rel=1e-9)
    assert rotor_blades.contrast_of([np.zeros(5, complex)], [2]) == 0


def test_the_held_share_is_the_lines_power_over_the_rest_s_under_the_window():
    rng = stream(8, "rests")
    rests, combs = rng.standard_normal((2, 50, 2)) @ [1, 1j], rng.standard_normal((2, 9, 2)) @ [1, 1j]
    window = np.sin(np.pi * np.arange(1, 51) / 51) ** 2
    shares = [
        sum(abs(comb[place]) ** 2 for place in range(4 - edge, 5 + edge)) * window.sum() / (window @ abs(rest) ** 2)
        for rest, comb, edge in zip(rests, combs, (2, 4), strict=True)
    ]
    assert rotor_blades.held_share(rests, list(combs), [2, 4]) == pytest.approx(np.mean(shares), rel=1e-9)
