"""The classes of a data set: the words in the column `category` of its table of targets.

The classes stand in the order in which the table names them first, and a class's index in that
order is its label. The order travels with the data: in the settings of the stages, in the index of
the shards, in a trained model and in the record next to a prediction file. Where one of these names
no classes, it has the published four.

The first class is the one that a detector looks for; false alarms are samples of other classes that
the detector gives its name.

A target is built, moves and reflects like one of the published four classes, which a record names
in its key `like`. The key is needed for a user's own class only.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from lowalt.files.errors import InputError, shown

CATEGORIES = ("UAV", "Bird", "Vehicle", "Pedestrian")
"""The published classes in their label order, and what a target can be like."""

AIRBORNE = ("UAV", "Bird")
"""Categories that fly; the other two stay on the ground."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9 ()_-]{0,39}")
_SUBTYPE = re.compile(r"[^\W_][\w .,:+()/&'#-]{0,79}")
_PLURALS = {"UAV": "UAVs", "Bird": "birds", "Vehicle": "vehicles", "Pedestrian": "pedestrians"}


def refuse_subtype(name: object, where: str | Path) -> None:
    """Refuse a name of a subtype that a page, a table calculation or a terminal would take for more
    than a name. Raises: InputError naming `where`.
    """
    if not isinstance(name, str) or not _SUBTYPE.fullmatch(name):
        raise InputError(
            f"{where}: the subtype's name is {shown(name)}, expected a letter or digit, then at"
            " most 79 letters, digits, spaces or _.,:+()/&'#-"
        )


def classes_of(table: Mapping[str, dict]) -> tuple[str, ...]:
    """Return the classes of a table of targets by subtype, in the order of their first rows.

    Raises: InputError for a name that is no word, or two names that differ only in capitals, spaces
    or hyphens.
    """
    names = tuple(dict.fromkeys(row["category"] for row in table.values()))
    for name in names:
        if not _NAME.fullmatch(name):
            raise InputError(
                f"table of targets: category {name!r}, expected a letter, then letters, digits, "
                "spaces or ()-_"
            )
    if len({word(name) for name in names}) < len(names):
        raise InputError(
            f"table of targets: categories {list(names)}, expected names that differ in their "
            "letters"
        )
    return names


def stated(content: Mapping) -> tuple[str, ...]:
    """Return the classes that an index, a model or a run's record states, or the published four."""
    return tuple(content.get("classes", CATEGORIES))


def label(classes: tuple[str, ...], row: Mapping) -> int:
    """Return the label of a row of the motion table: the index of its category among the classes.

    Raises: InputError naming the subtype and the category that is no class.
    """
    if row["category"] not in classes:
        raise InputError(
            f"{row['subtype']}: category {row['category']!r}, expected one of {list(classes)}"
        )
    return classes.index(row["category"])


def word(name: str) -> str:
    """Return a class's name as columns of tables have it: small, with _ for spaces and hyphens."""
    return re.sub(r"[ -]", "_", name.lower())


def plural(name: str) -> str:
    """Return a class's name for several targets: its plural if published, else as it is written."""
    return _PLURALS.get(name, name)


def like(record: Mapping) -> str:
    """Return the published class like which a record's target is built, moves and reflects.

    Raises: InputError naming the subtype where neither its key `like` nor its category says it.
    """
    name = record.get("like", record["category"])
    if name not in CATEGORIES:
        key = "like" if "like" in record else "category"
        raise InputError(
            f"{record.get('subtype', 'record')}: {key} is {name!r}, expected a key `like` with one "
            f"of {list(CATEGORIES)}, which says how a target of another class is built, moves and "
            "reflects"
        )
    return name


def listed(names: Iterable[str]) -> str:
    """Return names as English lists them: "a", "a and b", "a, b and c"."""
    *most, last = names
    if not most:
        return last
    return f"{', '.join(most)} and {last}"
