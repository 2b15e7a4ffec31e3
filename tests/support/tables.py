"""Tables of `tests/data/tables`: what a user may write, and the words with which it is refused."""

from pathlib import Path

from lowalt.files.yaml_files import load_yaml

FOLDER = Path(__file__).parents[1] / "data/tables"


def rows(table: str, part: str) -> list[tuple]:
    """Return the rows of a part of a table, each as its values in the order of the first row's keys,
    for `pytest.mark.parametrize`.
    """
    found = load_yaml(FOLDER / f"{table}.yaml")[part]
    return [tuple(row[key] for key in found[0]) for row in found]
