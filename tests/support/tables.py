"""Tables of `tests/data/tables`: what a user may write, and the words with which it is refused."""

from pathlib import Path

from lowalt.files.yaml_files import load_yaml

FOLDER = Path(__file__).parents[1] / "data/tables"


def rows(table: str, part: str) -> list[tuple]:
    """Return the rows of a part of a table, each as its values in their order, for
    `pytest.mark.parametrize`.
    """
    return [tuple(row.values()) for row in load_yaml(FOLDER / f"{table}.yaml")[part]]
