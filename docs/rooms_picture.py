"""The picture of the package: its rooms in the order of the data, what each holds, and which rooms it imports.

    python docs/rooms_picture.py --figure design/pictures/house.png

Everything in it is read from the source files: purposes (first line of each room's docstring), inner rooms, imports.
"""

import argparse
import textwrap

from matplotlib import pyplot as plt

from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.files.package_plan import EXTENSIONS, PACKAGE, ROOMS, modules, purpose, rooms_imported
from lowalt.report.figures.style import png

WIDTH = 60
"""Characters in a line of a room's text."""


def imports() -> tuple[list[str], list[str]]:
    """Return the pairs (room, room that it imports) as two lists, a pair as often as a file of the room imports it."""
    pairs = [
        (room, other) for room in ROOMS for path in modules(room) for other in rooms_imported(path) if other != room
    ]
    return [room for room, _ in pairs], [other for _, other in pairs]


def extensions_in_words() -> str:
    """Return a line for each extension: its name, and its purpose."""
    lines = [f"{name.rpartition('/')[2]}: {purpose(PACKAGE / name / '__init__.py')}" for name in EXTENSIONS]
    return "\n".join(["extensions, which build on the core and which no room imports:", *lines])


def inner_rooms(room: str) -> list[str]:
    """Return the folders inside a room, sorted."""
    return sorted(path.parent.name for path in (PACKAGE / room).glob("*/__init__.py"))


def _words(room: str) -> str:
    """A room's purpose, broken into lines, and the names of its inner rooms."""
    inner = inner_rooms(room)
    rooms = [f"inner rooms: {', '.join(inner)}"] if inner else []
    return "\n".join([textwrap.fill(purpose(PACKAGE / room / "__init__.py"), WIDTH), *rooms])


def draw() -> bytes:
    """Return PNG bytes: one row per room, in the order in which data passes them, and one column per imported room.

    A dot means that the room of the row imports that of the column. Its area grows with the number of importing files.
    """
    rows, columns = imports()
    count = len(ROOMS)
    figure, panel = plt.subplots(figsize=(16, 0.62 * count + 1.2))
    for place, room in enumerate(ROOMS):
        panel.axhline(place + 0.5, color="0.9", lw=0.8)
        panel.text(-8.2, place, room, fontsize=13, weight="bold", va="center", ha="right")
        panel.text(-7.9, place, _words(room), fontsize=8.5, va="center", color="0.25", linespacing=1.3)
        panel.add_patch(plt.Rectangle((place - 0.5, place - 0.5), 1, 1, color="0.92", zorder=0))
    for room, other in dict.fromkeys(zip(rows, columns, strict=True)):
        files = sum((room, other) == pair for pair in zip(rows, columns, strict=True))
        panel.scatter(ROOMS.index(other), ROOMS.index(room), s=18 * files, color="C0", alpha=0.8, linewidths=0)
    panel.set(xlim=(-10.8, count - 0.5), ylim=(count - 0.5, -0.5))
    panel.xaxis.tick_top()
    panel.set_xticks(range(count), ROOMS, rotation=40, ha="left", fontsize=10)
    panel.set_yticks([])
    panel.tick_params(length=0)
    for side in panel.spines.values():
        side.set_visible(False)
    panel.set_xlabel("a dot: files of the row's room import the column's room; all dots lie left of the grey diagonal")
    figure.text(0.02, 0.012, extensions_in_words(), fontsize=9.5, color="0.25", linespacing=1.5, va="bottom")
    figure.tight_layout(rect=(0, 0.12, 1, 1))
    return png(figure, 64)


def main(arguments: list[str]) -> None:
    """Write the picture."""
    line = argparse.ArgumentParser("rooms_picture.py", description=__doc__)
    line.add_argument("--figure", required=True, help="picture to write (.png)")
    options = line.parse_args(arguments)
    with replacing(options.figure) as temporary:
        temporary.write_bytes(draw())


if __name__ == "__main__":
    run(main)
