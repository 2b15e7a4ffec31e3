"""Documents: tables are written between their marks from the CSVs, and a document without marks is
refused.
"""

import pytest
from filled_tables import fill, main

from lowalt.files.errors import InputError

ACCURACY = """protocol,scheme,snr_db,accuracy_percent,samples,hardware
seen,A:VT,3,90,10,here
seen,A:VT,avg,91.25,20,here
unseen,A:VT,avg,81,20,here
"""
ORDERINGS = """protocol,scheme,over,claim,paper_points,difference_points,low,high,ordering
seen,A:X,A:VT,spectra,0.5,-1.0,-2,0.5,undecided
seen,A:X,A:VRP,spectra,0.5,3.0,2,4,holds
"""


def test_tables_stand_between_their_marks_and_can_be_written_again(tmp_path):
    (tmp_path / "t-accuracy.csv").write_text(ACCURACY)
    (tmp_path / "t-orderings.csv").write_text(ORDERINGS)
    path = tmp_path / "document.md"
    path.write_text("before\n<!-- schemes -->\nstale\n<!-- end of schemes -->\nafter\n")
    main([str(path), f"schemes={tmp_path}/t-"])
    text = path.read_text()
    assert "| A:VT | 91.2 | 97.9 | 81.0 | 93.4 |" in text
    assert "1 hold; not decided by these samples: A:X over A:VT (seen)." in text
    assert "| spectra | seen | A:X | A:VT | +0.5 | -1.0 | -2.0 to +0.5 | undecided |" in text
    assert text.startswith("before\n") and text.endswith("\nafter\n") and "stale" not in text
    main([str(path), f"schemes={tmp_path}/t-"])
    assert path.read_text() == text


def test_a_document_without_its_marks_is_refused():
    for text in (
        "",
        "<!-- end of cost -->\n<!-- cost -->\n",
        "<!-- cost -->\n<!-- cost -->\n<!-- end of cost -->",
    ):
        with pytest.raises(InputError, match="each once"):
            fill(text, "cost", "")
    with pytest.raises(InputError, match="expected DOCUMENT"):
        main(["README.md", "colours=x"])
