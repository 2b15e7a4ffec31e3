"""The section on subtypes: the worst first, and its reasons from test samples of the last protocol alone."""

from types import SimpleNamespace

from lowalt.config.classes import CATEGORIES
from lowalt.report.sections import subtypes
from made_predictions import SUBTYPES, run_files


def test_reasons_are_those_of_test_samples_and_the_worst_subtype_stands_first(tmp_path):
    path, found, _ = run_files(tmp_path, "unseen", "ABC:VRP", 0.6)
    rows = [{"protocol": "seen", "scheme": "ABC:VRP", "subtype": name, "category": CATEGORIES[label],
             "accuracy_percent": str(20 + 7 * place)}
            for place, (name, (_, label)) in enumerate(SUBTYPES.items())]  # fmt: skip
    rows += [{**row, "protocol": "unseen", "accuracy_percent": str(90 - float(row["accuracy_percent"]))}
             for row in rows if SUBTYPES[row["subtype"]][0] == "unseen"]  # fmt: skip
    tables = {"subtypes": rows, "distances": []}
    methods = {"__contains__": lambda *_: True, "paths": lambda *_: [path], "table": lambda _, name, *__: tables[name]}
    inputs = type("Inputs", (), methods)()
    shown = subtypes.values(SimpleNamespace(inputs=inputs, shards=SimpleNamespace(classes=CATEGORIES)))
    assert set(shown["reasons"]) == {name for name, (group, _) in SUBTYPES.items() if group == "unseen"}
    last = [float([*values.values()][-1]) for _, _, values in shown["rows"]]
    assert last == sorted(last)
    models = len({key.rpartition("-")[0] for key in found.key[found.subtype == "Owl"].tolist()})
    assert f"of {models} motion models are wrong" in shown["reasons"]["Owl"]
