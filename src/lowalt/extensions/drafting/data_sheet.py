"""`lowalt target drone | bird | vehicle`: a target from its data sheet, without a mesh."""

import argparse
from pathlib import Path

from lowalt.commands.command_line import Answer, add_command, positive


def _band(text: str) -> tuple[float, float]:
    """Two numbers LOW:HIGH, or one for both. Raises: ArgumentTypeError for other text."""
    try:
        numbers = [float(part) for part in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2) or not 0 < numbers[0] <= numbers[-1] < 1e4:
        raise argparse.ArgumentTypeError(f"{text!r}, expected LOW:HIGH in Hz, such as 50:120")
    return numbers[0], numbers[-1]


SIZES = {
    "drone": {
        "rotors": "number of rotors",
        "diagonal": "largest distance between two motor axes (m)",
        "propeller": "propeller's diameter (m)",
        "blades": "blades of a rotor",
    },
    "bird": {"length": "length from bill tip to tail tip (m)", "span": "wing span (m)"},
    "vehicle": {
        "length": "length (m)",
        "width": "width (m)",
        "height": "height (m)",
        "wheel": "rolling diameter of a wheel (m)",
        "wheel-base": "distance between the axles (m)",
    },
}
EXAMPLES = {
    "drone": "lowalt target drone --rotors 6 --diagonal 1.13 --propeller 0.53 --blades 2 --rate "
    "50:120 --speed 18 --out m600.yaml",
    "bird": "lowalt target bird --length 0.46 --span 0.99 --rate 3:5 --speed 13 --out "
    "carrion-crow.yaml",
    "vehicle": "lowalt target vehicle --length 4.63 --width 1.85 --height 1.44 --wheel 0.67 "
    "--wheel-base 2.85 --speed 30 --out sedan.yaml",
}
FRAMES = {"drone": "radial", "bird": "bird", "vehicle": "car"}
"""Usual frame of each kind."""
COAXIAL_HELP = {"drone": "; coaxial has two rotors on each arm"}


def add_sheets(actions: argparse._SubParsersAction) -> None:
    """Add `drone`, `bird` and `vehicle` to the commands of `lowalt target`."""
    metres = positive(1e5, "a positive number")
    for kind, sizes in SIZES.items():
        line = add_command(
            actions, kind, _draft, f"draft a {kind}'s record from its data sheet", EXAMPLES[kind]
        )
        line.set_defaults(kind=kind)
        for word, meaning in sizes.items():
            kind_of_number = int if word in ("rotors", "blades") else metres
            line.add_argument(f"--{word}", type=kind_of_number, required=True, help=meaning)
        if kind != "vehicle":
            line.add_argument(
                "--rate",
                type=_band,
                required=True,
                metavar="LOW:HIGH",
                help="revolutions or wing beats a second (Hz)",
            )
            line.add_argument("--climb", type=metres, help="highest vertical speed (m/s)")
        line.add_argument(
            "--speed", type=metres, required=True, help="highest speed over ground (m/s)"
        )
        frames = "built-in model (default: %(default)s)" + COAXIAL_HELP.get(kind, "")
        line.add_argument("--frame", default=FRAMES[kind], help=frames)
        line.add_argument("--subtype", default="", help="its name (default: that of the file)")
        line.add_argument(
            "--about", default="data sheet", help="which data sheet it is, for the record"
        )
        line.add_argument("--out", type=Path, help="record file to write (default: print it)")


def _draft(options: argparse.Namespace) -> Answer:
    """Draft the record and write it."""
    from lowalt.extensions.drafting.scaled import KINDS, draft_target

    kind = KINDS[options.kind]
    stated = {word: getattr(options, word) for word in {**kind.cells, **kind.figures}}
    text, lender = draft_target(
        options.kind,
        options.out,
        subtype=options.subtype,
        frame=options.frame,
        about=options.about,
        **stated,
    )
    if options.out is None:
        return Answer({"file": None, "text": text}, text)
    name = options.subtype or options.out.stem
    said = f"{options.out}: {name!r}; what the data sheet does not say is {lender}'s, scaled"
    return Answer({"file": options.out, "text": text}, said)
