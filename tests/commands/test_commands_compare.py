"""The command compare: the differences between two finished runs, and their size."""

import json

from lowalt.__main__ import main
from run_folders import run_folder


def test_compare_says_what_differs_and_by_how_much(tmp_path, capsys):
    one = run_folder(tmp_path / "one", 80, 5.0)
    other = run_folder(tmp_path / "other", 81, 2.5, seed=2)
    assert main(["compare", str(one), str(other), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["configuration"] == {"run": ["one", "other"], "seed": [1, 2]}
    assert found["accuracy_percent"] == {"seen A:VT": [81.0, 82.0]}
    assert found["processor_s"] == {"echo": [5.0, 2.5]} and found["data"] == {}
    (one / "shards").mkdir()
    (one / "shards/index.json").write_text(json.dumps({"samples": 30, "bytes": 4000}))
    assert main(["compare", str(one), str(other)]) == 0
    assert (
        capsys.readouterr().out
        == f"""configuration: {one} | {other}
  run   one | other
  seed  1 | 2

accuracy percent: {one} | {other}
  seen A:VT  81 | 82   +1

processor s: {one} | {other}
  echo  5 | 2.5   -2.5 (-50.0%)

data: {one} | {other}
  samples  30 | -
  bytes    4000 | -
"""
    )
    assert main(["compare", str(one), str(tmp_path)]) == 2
    assert f"{tmp_path}: has no config.yaml" in capsys.readouterr().err
