"""A tree of one module and a folder of tests, for tests of planted faults."""

from pathlib import Path


def small_tree(folder: Path, source: str) -> Path:
    """Write src/lowalt/reach.py with this text and an empty folder of tests into `folder`, and return it."""
    (folder / "src/lowalt").mkdir(parents=True)
    (folder / "tests").mkdir()
    (folder / "src/lowalt/reach.py").write_text(source)
    return folder
