"""Tables as CSV: their bytes are those written down here, and nothing half-written or misnamed is
left behind.
"""

import numpy as np
import pytest

from lowalt.files.csv_tables import read_csv, short, write_csv


def test_a_table_has_these_bytes_and_is_read_back_as_text(tmp_path):
    path = tmp_path / "table.csv"
    write_csv(
        path,
        ("name", "value", "note"),
        [["a, b", 0.1 + 0.2, None], {"value": 3, "name": 'say "x"'}],
    )
    assert path.read_bytes() == b'name,value,note\n"a, b",0.30000000000000004,\n"say ""x""",3,\n'
    first, second = read_csv(path, "name", "note")
    assert first == {"name": "a, b", "value": "0.30000000000000004", "note": ""}
    assert second["name"] == 'say "x"'


def test_empty_lines_of_a_table_are_no_rows(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("a,b\n\n1,2\n\n")
    assert read_csv(path) == [{"a": "1", "b": "2"}]


def test_a_key_that_is_no_column_is_refused_and_leaves_the_old_table(tmp_path):
    path = tmp_path / "table.csv"
    write_csv(path, ["a"], [[1]])
    with pytest.raises(
        ValueError, match=r"table\.csv: keys \['b'\], expected only the columns \['a'\]"
    ):
        write_csv(path, ["a"], [{"a": 1}, {"a": 2, "b": 3}])
    assert path.read_text() == "a\n1\n"
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]


def test_short_cells_have_six_digits():
    assert [short(value) for value in (1 / 3, 2e9, None, 7, "x", "")] == [
        "0.333333",
        "2e+09",
        "",
        7,
        "x",
        "",
    ]
    assert short(np.float64(0.125)) == "0.125"
