"""Schemes: the ends of every range in a row, places of views among fewer spectra, and names of stations."""

import json

import pytest

from lowalt.files.errors import InputError
from lowalt.recognition import schemes

ROW = {"scheme": "x", "stations": "A", "spectra": "VT", "fusion": "attention", "backbone": "", "protocols": "seen"}


def made(**changes):
    return schemes.scheme({**ROW, **changes}, "table line 2", "ABC")


@pytest.mark.parametrize(
    ("column", "good", "bad"),
    [("size", ("8", "1024"), ("7", "1025", "8.5", "x")), ("steps", ("1", "1000000000"), ("0", "1000000001", "1.5")),
     ("share", ("0.000001", "1"), ("0.0000009", "1.0000001", "-1", "nan"))],
)  # fmt: skip
def test_numbers_of_a_row_are_taken_up_to_both_ends_of_their_range(column, good, bad):
    for text in good:
        assert getattr(made(**{column: text}), column) == float(text)
    for text in bad:
        with pytest.raises(InputError, match=f"table line 2: {column} '{text}', expected nothing or a number in"):
            made(**{column: text})
    empty = made(**{column: ""})
    assert (empty.size, empty.steps, empty.share) == (0, 0, 1.0)


def test_views_are_numbered_over_all_spectra_and_found_among_those_a_data_set_has():
    """The catalogue begins with VRP, TRP and VT; the data set's tiles hold VT before VRP, and no TRP."""
    count = len(schemes.SPECTRA)
    scheme = schemes.Scheme("x", (0, 2), (0, 2))
    assert scheme.columns == [0, 2, 2 * count, 2 * count + 2]
    assert schemes.columns_in(scheme.columns, ["vt", "vrp"], 3, "here") == [1, 0, 5, 4]
    with pytest.raises(InputError, match="here: 2 stations, the scheme needs 3"):
        schemes.columns_in(scheme.columns, ["vt", "vrp"], 2, "here")
    with pytest.raises(InputError, match=r"here: spectra \['vt'\], the scheme also needs \['vrp'\]"):
        schemes.columns_in(scheme.columns, ["vt"], 3, "here")


def test_stations_of_one_letter_stand_together_and_others_are_joined():
    assert made().stations == (0,)
    assert schemes.scheme({**ROW, "stations": "CA"}, "", "ABC").stations == (0, 2)
    names = ["north", "south", "W"]
    assert schemes.scheme({**ROW, "stations": "W+north"}, "", names).stations == (0, 2)
    assert schemes.joined(["A", "B"]) == "AB" and schemes.joined(["A", "west"]) == "A+west"


def test_a_record_is_the_scheme_and_survives_json():
    plain = schemes.Scheme("x", (0,), (1, 2), size=24)
    assert schemes.of_record(plain.record) == schemes.of_record(json.loads(json.dumps(plain.record))) == plain
