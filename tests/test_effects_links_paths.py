"""Reflections and turned beams on links: four paths by hand, limits where both ends coincide, and reciprocity."""

from dataclasses import replace

import numpy as np
import pytest

import reference_effects
from lowalt.effects import steering
from lowalt.effects.catalogue import called
from lowalt.effects.channel import ground_reflection, reflected_aspect, walls
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.response import ImagePath, response
from test_effects_links import A, B, link, linked
from test_effects_links_points import seen

MATERIAL = {"permittivity": 6.0, "conductivity_s_m": 0.0}
FACADES = {"facades": [[60.0, -40.0, 90.0, 400.0, 80.0], [-30.0, 20.0, 0.0, 300.0, 80.0]], "permittivity": 4.0}
THERE = replace(B, frequency_hz=A.frequency_hz)
"""The second station on the first one's frequency, for which both directions of a link are alike."""


def scene(effects, radio, tolerance=None):
    """A scene of these effects."""
    return Scene(radio, 5, tolerance, tuple(called(effects)))


def fresnel(sine, permittivity, parallel):
    """Coefficient of a lossless half space at a grazing angle, electric field in the plane of incidence or across."""
    root = np.sqrt(permittivity - 1.0 + sine**2)
    down = permittivity * sine if parallel else sine
    return (down - root) / (down + root)


@pytest.mark.parametrize("polarisation", ["vertical", "horizontal"])
def test_a_link_over_ground_has_four_paths_each_end_with_its_own_coefficient(polarisation):
    radio = linked(subcarriers=9, symbols=2, transmit=(3, 2), receive=(2, 1))
    own = seen(link(), radio)
    station = radio.station("A-B")
    whole = scene({"ground_reflection": {**MATERIAL, "polarisation": polarisation}}, radio)
    view = observe(whole, station, own.cloud, own.row)
    settings = ground_reflection.DEFAULTS | whole.effects[0].settings
    out, back = (ground_reflection.paths(settings, end) for end in view.ends())
    found = response(
        radio, station, view.places, view.cloud.rcs_m2, view.aim_m, paths=[back[0]._replace(sender=out[0])]
    )
    scale = np.sqrt(radio.power / 12) * reference_effects.C / radio.carrier_hz / (4 * np.pi) ** 1.5
    truth = np.zeros((2, 9), complex)
    for n in range(2):
        for m in range(9):
            f, ways = A.frequency_hz + m * radio.subcarrier_spacing_hz, []
            for end, shape in ((A, radio.transmit), (THERE, radio.receive)):
                given = radio, end, shape
                image = view.places[n] * [1, 1, -1]
                sine = (view.places[n][:, 2] + end.position_m[2]) / np.linalg.norm(image - end.position_m, axis=1)
                mirror = fresnel(sine, 6.0, polarisation == "vertical")
                direct, bent = (
                    reference_effects.one_way(*given, places, view.aim_m, f, False, False)
                    for places in (view.places[n], image)
                )
                ways.append(direct + mirror * bent)
            truth[n, m] = (scale * np.sqrt(view.cloud.rcs_m2) * ways[0] * ways[1]).sum()
    # Coefficients are those at the middle of the band, and a series of the sine.
    assert abs(found - truth).max() < 1e-6 * abs(truth).max()


EVERY = {
    "ground_reflection": {"ground_reflection": MATERIAL},
    "walls": {"walls": FACADES},
    "aspect by mirrors": {
        "ground_reflection": MATERIAL, "walls": FACADES, "reflected_aspect": {}, "cross_sections": {},
        "occlusion": {"blades": "opaque"},
    },
    "moving paths": {"ground_reflection": MATERIAL, "walls": FACADES, "symbol_motion": {}, "wavefront": {}},
    "cut paths": {"ground_reflection": MATERIAL, "cyclic_prefix": {"prefix_s": 2e-7}, "squint": {}},
    "elements": {"ground_reflection": MATERIAL, "element_pattern": {"downtilt_deg": 6.0}},
    "pointing": {"pointing_error": {"sigma_deg": 2.0}, "element_pattern": {}},
    "updates": {"pointing_error": {"sigma_deg": 2.0, "update_s": 5e-3}, "ground_reflection": MATERIAL},
}  # fmt: skip
"""Scenes whose echo on a link follows from its two ends."""


def received(effects, radio, station):
    """The signal of the box of `seen` at a station or link."""
    own = seen(A, radio)
    return received_signal(scene(effects, radio), station, own.cloud, own.row, own.occluders).signal


@pytest.mark.parametrize("effects", EVERY.values(), ids=EVERY)
def test_a_link_back_to_its_own_place_hears_the_stations_own_echo(effects):
    radio = linked(symbols=6, subcarriers=32, transmit=(4, 2), receive=(4, 2))
    own, back = (received(effects, radio, end) for end in (A, replace(link(A, A), name="A")))
    assert abs(own - back).max() < 1e-12 * abs(own).max()
    assert abs(own - received({}, radio, A)).max() > 1e-4 * abs(own).max()


@pytest.mark.parametrize("effects", EVERY.values(), ids=EVERY)
def test_a_link_is_the_same_in_both_directions(effects):
    radio = linked(symbols=6, subcarriers=32, transmit=(4, 2), receive=(4, 2))
    # Both ways take their data of one stream.
    one, two = (received(effects, radio, replace(way, name="AB")) for way in (link(A, THERE), link(THERE, A)))
    assert abs(one - two).max() < 1e-11 * abs(one).max()
    assert abs(one - received({}, radio, link(A, THERE))).max() > 1e-4 * abs(one).max()


def test_effects_that_are_idle_change_no_bit_of_a_link():
    radio, own = linked(symbols=6, subcarriers=32), seen(A)
    off = {
        "ground_reflection": {"permittivity": 1.0, "conductivity_s_m": 0.0}, "walls": {"facades": []},
        "pointing_error": {"sigma_deg": 0.0}, "fluctuation": {"pattern": False, "spread_db": 0.0},
        "clutter": {"gamma": 0.0}, "line_of_sight": {"blocked_db": 0.0}, "reflected_aspect": {"follow": []},
    }  # fmt: skip
    bare, idle = (
        received_signal(scene(effects, radio), radio.station("A-B"), own.cloud, own.row).signal for effects in ({}, off)
    )
    assert (bare == idle).all()


def test_each_end_of_a_link_points_as_its_station_does():
    radio = linked(symbols=4, transmit=(8, 1), receive=(4, 2))
    own, asked = seen(A, radio), scene({"pointing_error": {"sigma_deg": 1.5}}, radio)
    ends = [observe(asked, end, own.cloud, own.row) for end in (A, B)]
    view = observe(asked, radio.station("A-B"), own.cloud, own.row)
    assert (view.aims_m == [end.aim_m for end in ends]).all() and (view.aims_m[0] != view.aims_m[1]).all()
    found = steering.echo(view)[:, 0]
    scale = np.sqrt(radio.power / 64) * reference_effects.C / radio.carrier_hz / (4 * np.pi) ** 1.5
    for n in range(4):
        out, back = (
            reference_effects.one_way(radio, end, shape, view.places[n], aim, A.frequency_hz, False, False)
            for end, shape, aim in ((A, (8, 1), view.aims_m[0]), (THERE, (4, 2), view.aims_m[1]))
        )
        truth = (scale * np.sqrt(view.cloud.rcs_m2) * out * back).sum()
        assert abs(found[n] - truth) < 1e-9 * abs(truth)


def test_updates_of_either_end_do_not_turn_a_points_phase():
    radio = linked(symbols=12, transmit=(8, 2), receive=(4, 4))
    own = seen(A, radio)
    cloud = replace(own.cloud, points=np.zeros_like(own.cloud.points), part=np.zeros(len(own.cloud.part), int))
    still, followed = (
        steering.echo(observe(scene(one, radio), radio.station("A-B"), cloud, own.row))[:, 0]
        for one in ({}, {"pointing_error": {"sigma_deg": 0.0, "update_s": 0.005}})
    )
    # All points stand at the origin, whose phase is that of the arrays' middles.
    assert abs(np.angle(followed * still.conj())).max() < 1e-9 and (abs(followed) != abs(still)).any()


def test_beams_of_both_ends_change_at_their_own_instants():
    radio = linked(symbols=8)
    own = seen(link(), radio)
    moved = np.array([[[0, 0, 0], [1, 0, 0]], [[0, 2, 0], [0, 0, 3]]])
    turning = replace(own, beams={
        "A": own.beams_of(A)._replace(starts_s=np.array([0.0, 5e-3]), aims_m=own.origin_m + moved[0]),
        "B": own.beams_of(B)._replace(starts_s=np.array([0.0, 7.5e-3]), aims_m=own.origin_m + moved[1]),
    })  # fmt: skip
    rows = turning.beam_rows()
    assert [(aims - own.origin_m).tolist() for _, aims, _ in rows] == [
        [[0, 0, 0], [0, 2, 0]], [[1, 0, 0], [0, 2, 0]], [[1, 0, 0], [0, 0, 3]],
    ]  # fmt: skip
    assert [mine.tolist() for _, _, mine in rows] == [[0, 1], [2], [3, 4, 5, 6, 7]]


def test_a_point_hidden_from_one_image_echoes_by_the_other_ways():
    view = seen(link())
    settings, count = reflected_aspect.DEFAULTS, len(view.cloud.points)
    below = [np.asarray(end.position_m) * [1, 1, -1] for end in (A, B)]
    path = ImagePath(view.places, 1.0, below[1], ImagePath(view.places, 1.0, below[0]))

    def product(effects, one):
        """A factor that says of the place from which it is seen: 2 at A, 3 at its image, 5 at B, 7 at its image."""
        table = {A.position_m: 2.0, tuple(below[0]): 3.0, B.position_m: 5.0, tuple(below[1]): 7.0}
        ends = [table[tuple(end.station.position_m)] for end in one.ends()]
        return np.full((len(one.times_s), count), np.sqrt(np.prod(ends)) if len(ends) == 2 else ends[0]) ** len(effects)

    weighing = called({"occlusion": {}})
    found = reflected_aspect.routes(settings, view, [path], weighing, product)
    assert found.shape == (2, 2, len(view.times_s), count)
    assert found[:, :, 0, 0] ** 2 == pytest.approx(np.array([[2 * 5, 2 * 7], [3 * 5, 3 * 7]]))
    blind = reflected_aspect.routes({"follow": ["fluctuation"]}, view, [path], weighing, product)
    assert blind**2 == pytest.approx(10.0)


def test_a_facade_reflects_between_points_on_each_ends_own_side():
    radio = linked(symbols=6, subcarriers=32)
    own = seen(link(), radio)
    # B stands beyond this wall, A and the target before it.
    settings = walls.DEFAULTS | {"facades": [[100.0, 0.0, 0.0, 400.0, 80.0]]}
    out, back = (walls.paths(settings, end)[0] for end in own.ends())
    assert np.all(out.coefficient) and not np.any(back.coefficient)
