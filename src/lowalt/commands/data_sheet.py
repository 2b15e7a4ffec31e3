"""`lowalt target drone | bird | vehicle`: a target from its data sheet, without a mesh."""

import argparse
from pathlib import Path

from lowalt.commands.command_line import Answer, add_command
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError


def _band(text: str) -> tuple[float, float]:
    """Two numbers LOW:HIGH, or one for both. Raises: ArgumentTypeError for other text."""
    try:
        numbers = [float(part) for part in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2) or not 0 < numbers[0] <= numbers[-1] < 1e4:
        raise argparse.ArgumentTypeError(f"{text!r}, expected LOW:HIGH in Hz, such as 50:120")
    return numbers[0], numbers[-1]


def _positive(text: str) -> float:
    """A positive number. Raises: ArgumentTypeError for other text."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e5:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a positive number")
    return value


SIZES = {
    "drone": {"--diagonal": "largest distance between two motor axes (m)", "--propeller": "propeller's diameter (m)"},
    "bird": {"--length": "length from bill tip to tail tip (m)", "--span": "wing span (m)"},
    "vehicle": {"--length": "length (m)", "--width": "width (m)", "--height": "height (m)",
                "--wheel": "rolling diameter of a wheel (m)", "--wheel-base": "distance between the axles (m)"},
}  # fmt: skip
EXAMPLES = {
    "drone": "lowalt target drone --rotors 6 --diagonal 1.13 --propeller 0.53 --blades 2 --rate 50:120 --speed 18 "
    "--out m600.yaml",
    "bird": "lowalt target bird --length 0.46 --span 0.99 --rate 3:5 --speed 13 --out carrion-crow.yaml",
    "vehicle": "lowalt target vehicle --length 4.63 --width 1.85 --height 1.44 --wheel 0.67 --wheel-base 2.85 "
    "--speed 30 --out sedan.yaml",
}
CATEGORIES = {"drone": ("UAV", "radial"), "bird": ("Bird", "bird"), "vehicle": ("Vehicle", "car")}
"""Category and usual frame of each command's targets."""


def add_sheets(actions: argparse._SubParsersAction) -> None:
    """Add `drone`, `bird` and `vehicle` to the commands of `lowalt target`."""
    for kind, sizes in SIZES.items():
        line = add_command(actions, kind, _draft, f"draft a {kind}'s record from its data sheet", EXAMPLES[kind])
        line.set_defaults(kind=kind)
        for option, meaning in sizes.items():
            line.add_argument(option, type=_positive, required=True, help=meaning)
        if kind == "drone":
            line.add_argument("--rotors", type=int, required=True, help="number of rotors")
            line.add_argument("--blades", type=int, required=True, help="blades of a rotor")
        if kind != "vehicle":
            line.add_argument("--rate", type=_band, required=True, metavar="LOW:HIGH",
                              help="revolutions or wing beats a second (Hz)")  # fmt: skip
            line.add_argument("--climb", type=_positive, help="highest vertical speed (m/s)")
        line.add_argument("--speed", type=_positive, required=True, help="highest speed over ground (m/s)")
        line.add_argument("--frame", default=CATEGORIES[kind][1], help="built-in model (default: %(default)s)")
        line.add_argument("--subtype", help="its name (default: that of the file)")
        line.add_argument("--about", default="data sheet", help="which data sheet it is, for the record")
        line.add_argument("--out", type=Path, help="record file to write (default: print it)")


def _draft(options: argparse.Namespace) -> Answer:
    """Draft the record and write it."""
    from lowalt.drafting.scaled import Sheet, drafted_sheet

    category, kind = CATEGORIES[options.kind][0], options.kind
    if kind == "vehicle":
        row = {"len_m": options.length, "wid_m": options.width, "hgt_m": options.height, "speed_hi": options.speed}
        figures = {"rolling_diameter": options.wheel, "wheel_base": options.wheel_base}
    else:
        row = {"size_m": options.diagonal if kind == "drone" else options.length,
               "freq_lo_hz": options.rate[0], "freq_hi_hz": options.rate[1], "vx_abs_max": options.speed,
               "vy_abs_max": options.speed, "vz_abs_max": options.climb}  # fmt: skip
        figures = {"length": options.length, "span": options.span} if kind == "bird" else {}
    if kind == "drone":
        row["n_rotors_or_wings"] = options.rotors
        figures = {"propeller_diameter": options.propeller, "blade_count": options.blades}
    subtype = options.subtype or (options.out.stem if options.out else f"My {kind}")
    text, lender = drafted_sheet(Sheet(category, options.frame, row, figures, options.about), subtype)
    if options.out is None:
        return Answer({"file": None, "text": text}, text)
    if options.out.exists():
        raise InputError(f"{options.out}: is there already, expected a new file")
    with replacing(options.out) as temporary:
        temporary.write_text(text)
    said = f"{options.out}: {subtype!r}; what the data sheet does not say is {lender}'s, scaled"
    return Answer({"file": options.out, "text": text}, said)
