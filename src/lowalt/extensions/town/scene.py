"""`lowalt scene inspect | new`: a picture of a town, and an overlay of a scene in it.

Both are made from a file of buildings.
"""

import argparse
from pathlib import Path

import numpy as np

from lowalt.commands.command_line import Answer, add_command, add_group
from lowalt.files.errors import InputError

EXAMPLE = "lowalt scene inspect town.geojson --origin 11.575 48.137"


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `scene` and its two commands to a parser's commands."""
    actions = add_group(commands, name)
    meaning = "size, walls and materials of a town, what was left out, and a plan with the stations"
    inspect = add_command(actions, "inspect", _inspect, meaning, EXAMPLE)
    inspect.add_argument(
        "--out", type=Path, help="picture to write (default: the file's name and -plan.png, here)"
    )
    meaning = "draft the overlay of a scene in a town, placed at the stations, and draw its plan"
    new = add_command(
        actions, "new", _new, meaning, "lowalt scene new town.geojson --out town.yaml"
    )
    new.add_argument(
        "--out",
        type=Path,
        required=True,
        help="overlay to write (.yaml); its plan is a .png next to it",
    )
    for line in (inspect, new):
        line.add_argument(
            "file",
            type=Path,
            help="a mesh, footprints with heights (GeoJSON), or a Mitsuba scene (.xml)",
        )
        line.add_argument(
            "overlay", type=Path, nargs="*", help="overlays on the default, for stations and region"
        )
        line.add_argument(
            "--origin",
            type=float,
            nargs=2,
            metavar=("X", "Y"),
            help="place in the file of x = y = 0: metres, in GeoJSON longitude and latitude "
            "(degrees); by default the middle of the town is that of the stations",
        )
        line.add_argument("--unit", help="unit of a mesh: m (default), cm, mm, in, ft")
        line.add_argument("--up", choices=("z", "y"), help="axis of a mesh that is up (default: z)")
        line.add_argument(
            "--height", type=float, help="height of GeoJSON buildings that state none (m)"
        )
        line.add_argument(
            "--left-out",
            type=float,
            metavar="SHARE",
            help="largest share of GeoJSON buildings that may be left out (default: 0.1)",
        )
        line.add_argument(
            "--material",
            help="material of surfaces without one, after ITU-R P.2040 (default: concrete)",
        )


def _settings(options: argparse.Namespace, middle: np.ndarray) -> dict:
    """The settings of the effect `town` by the options.

    middle: (2,) m, where the town's middle goes by default.
    """
    from lowalt.extensions.town import town
    from lowalt.extensions.town.buildings import read
    from lowalt.targets.mesh_files import UNITS_M

    if options.unit not in (None, *UNITS_M):
        raise InputError(f"--unit: {options.unit!r}, expected one of {list(UNITS_M)}")
    if options.left_out is not None and not 0.0 <= options.left_out <= 1.0:
        raise InputError(f"--left-out: {options.left_out:g}, expected a share from 0 to 1")
    given = {
        "unit": options.unit,
        "up": options.up,
        "height_m": options.height,
        "material": options.material,
        "left_out": options.left_out,
    }
    given = {
        "buildings": str(options.file),
        **{key: value for key, value in given.items() if value is not None},
    }
    if options.origin is not None:
        return given | {"origin": options.origin}
    if options.file.suffix.lower() in (".geojson", ".json"):
        from lowalt.extensions.town.footprints import middle_of, moved

        return given | {
            "origin": moved(middle_of(options.file, options.height), (-middle).tolist())
        }
    facts = read(town.DEFAULTS | given).facts
    centre = (np.array(facts["low_m"]) + facts["high_m"])[:2] / 2
    return given | {"origin": np.round(centre - middle, 1).tolist()}


def _examined(options: argparse.Namespace, picture: Path) -> tuple[dict, dict, list[str]]:
    """Draw the plan; return the effect's settings, facts about the town, and lines of text."""
    from lowalt.config.layers import overlaid
    from lowalt.config.network import Network, masts_m
    from lowalt.extensions.town import town, town_plan
    from lowalt.extensions.town.buildings import read
    from lowalt.motion.drawing import region_polygon

    config = overlaid(options.overlay)
    network = Network.from_settings(config["network"])
    masts = np.array(masts_m(config["network"]), float)
    region = np.asarray(region_polygon(masts, config["motion"]["region"]["polygon_m"]))
    settings = _settings(options, masts[:, :2].mean(axis=0))
    complete = town.DEFAULTS | settings
    found = read(complete)
    lines = town_plan.described(options.file, found)
    try:
        town.refuse_place(complete, network)
    except InputError as error:
        lines.append(f"a run would refuse it: {error}")
    town_plan.draw(picture, found, network, region)
    facts = {"settings": settings, **found.facts, "picture": picture}
    return settings, facts, [*lines, f"{picture}: its plan"]


def _inspect(options: argparse.Namespace) -> Answer:
    """Describe a town. Raises: InputError naming the file and what is wrong with it."""
    _, facts, lines = _examined(options, options.out or Path(f"{options.file.stem}-plan.png"))
    return Answer(facts, "\n".join(lines))


def _new(options: argparse.Namespace) -> Answer:
    """Draft an overlay.

    Raises: InputError naming the file and what is wrong with it, or an overlay that exists.
    """
    from lowalt.extensions.town import town_plan
    from lowalt.files.atomic import slug, write_file

    if options.out.suffix not in (".yaml", ".yml") or options.out.exists():
        raise InputError(f"--out: {options.out}, expected a new file that ends in .yaml")
    settings, facts, lines = _examined(options, options.out.with_suffix(".png"))
    comments = [
        *lines[:-1],
        f"Look: {facts['picture']}. Move the town by `origin`, or the stations in `network`.",
    ]
    write_file(options.out, town_plan.overlay(settings, slug(options.out.stem), comments))
    text = [
        *lines,
        f"{options.out}: drafted; `lowalt explain {options.out}` says what its paths change",
    ]
    return Answer({**facts, "overlay": options.out}, "\n".join(text))
