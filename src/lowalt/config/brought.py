"""What a configuration that may be a stranger's cannot choose: code, weights, files elsewhere.

A configuration file counts as a run's, and therefore possibly as a stranger's, if its name is
config.yaml, if it holds every key that a whole configuration needs, or if files of a run or of a
data set are in its folder. Any other file is an overlay: its user has written it, or must read it
before use as one reads a script.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from lowalt.config.named_code import allowed, file_of, own_effects
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError, shown
from lowalt.files.shipped import SHIPPED, shipped

NAME = "config.yaml"
"""Name of a run's configuration."""
BESIDE = ("index.json", "shards/index.json", "model.safetensors", "SHA256SUMS")
"""Files of a run or of a data set; a configuration in their folder came with them."""
OF_TRAINING = ("recognition", "report")
"""Blocks of a configuration that making samples does not use."""
OVERLAY = "an overlay of your own that names it"
ADVICE = f"which a file may not choose; expected {OVERLAY}"


def is_of_run(path: Path, content: Mapping, required: Iterable[str]) -> bool:
    """Return whether a configuration file counts as a run's.

    content: what it holds; required: the keys that a whole configuration has.
    """
    real = path.resolve()
    if NAME in (path.name, real.name) or set(required) <= set(content):
        return True
    return any((real.parent / name).exists() for name in BESIDE)


def refuse_brought(settings: Mapping, where: str | Path) -> None:
    """Refuse settings of a file that may be a stranger's if a text in them names code or a path.

    Allowed are paths below the working directory, below the folder of `where`, and in the package.
    No code is run and no file is opened. A link counts as the file that it leads to.
    Raises: InputError naming the key and the text.
    """
    for key, text in _texts(settings):
        if own_effects([text]) or file_of(text) is not None:
            kind = "effect" if key == "effects" else key.rpartition(".")[2]
            raise InputError(f"{where}: its {kind} {text!r} is code, {ADVICE}")
        if _leads_elsewhere(text, Path(where).parent):
            raise InputError(
                f"{where}: {key} is {shown(text)}, a place outside of this folder, {ADVICE}"
            )


def refuse_weights(weights: object, where: str | Path, how: str) -> None:
    """Refuse weights that a training would read from a file or ask a hub for.

    how: what the user may do instead. Raises: InputError naming them.
    """
    if weights != "none":
        raise InputError(
            f"{where}: its weights {shown(weights)} come from elsewhere, which a file may not"
            f" choose; expected {how}"
        )


def refuse_training(settings: Mapping, where: str | Path, how: str = OVERLAY) -> None:
    """Refuse settings of a file that may be a stranger's if they name weights, or a table with code.

    The table is that of the schemes; a scheme may name a backbone of the user's own.

    how: what the user may do instead. Raises: InputError naming the weights or the code.
    """
    block = settings.get("recognition")
    if not isinstance(block, Mapping):
        return
    network = block.get("network")
    if isinstance(network, Mapping) and "weights" in network:
        refuse_weights(network["weights"], where, how)
    table = block.get("table")
    if isinstance(table, str) and shipped(table).is_file():
        for row in read_csv(shipped(table), "backbone"):
            allowed(row["backbone"], "", where, how)


def _texts(settings: Mapping) -> Iterator[tuple[str, str]]:
    """Yield every text in nested mappings and lists, keys too, with the dotted key under which it
    stands.
    """
    waiting: list[tuple[str, object]] = [("", settings)]
    while waiting:
        key, value = waiting.pop()
        if isinstance(value, str):
            yield key, value
        elif isinstance(value, Mapping):
            for name, item in value.items():
                waiting.append((key, name))
                waiting.append((f"{key}.{name}".lstrip("."), item))
        elif isinstance(value, (list, tuple)):
            for item in value:
                waiting.append((key, item))


def _leads_elsewhere(text: str, folder: Path) -> bool:
    """Whether a text is the path of something outside of the working directory, a folder and the
    package.
    """
    path = Path(text)
    if ".." in path.parts:
        return True
    try:
        if not path.is_absolute() and not path.exists() and not path.is_symlink():
            return False
        real = path.resolve()
        inside = [root.resolve() for root in (Path.cwd(), folder, SHIPPED)]
    except (OSError, ValueError, RuntimeError):
        # No file can have this name, or links lead around in a circle.
        return path.is_absolute()
    return not any(real.is_relative_to(root) for root in inside)
