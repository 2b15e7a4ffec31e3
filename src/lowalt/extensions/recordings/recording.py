"""`lowalt recording inspect | train`: from a radar's file to a record of it, and from the record to
a recogniser.
"""

import argparse
import math
import shlex
import zlib
from pathlib import Path

from lowalt.commands.command_line import Answer, add_command, add_group, positive
from lowalt.commands.command_table import COMMANDS
from lowalt.extensions.recordings.file_inspection import FileInspection, Seen, inspect_recording
from lowalt.files.atomic import write_file
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped

DRAFTED = "# Drafted by `lowalt recording inspect`"
"""How a draft begins."""
WORDS = {
    "iqiq": "I and Q in turn",
    "iiqq": "all I, then all Q",
    "dca2": "DCA1000, two lanes: I0 I1 Q0 Q1",
    "dca4": "DCA1000, four lanes",
    "polar": "magnitude and phase",
}


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `recording` and its commands to a parser's commands."""
    actions = add_group(commands, name)
    hertz = positive(1e15, "hertz, such as 24e9")
    meaning = (
        "layouts that fit the file's bytes, the best first, a picture, and a draft of its record"
    )
    inspect = add_command(actions, "inspect", _inspect, meaning, COMMANDS[name].example)
    inspect.add_argument(
        "file",
        type=Path,
        help="the samples: WAV, MAT, HDF5, CSV, NPY, SigMF, or numbers without a header",
    )
    inspect.add_argument(
        "--carrier", type=hertz, metavar="HZ", help="carrier, where the file does not say it"
    )
    inspect.add_argument(
        "--rate",
        type=hertz,
        metavar="HZ",
        help="samples a second, where the file does not say it; of chirps, chirps a second",
    )
    inspect.add_argument(
        "--take",
        type=int,
        default=1,
        metavar="N",
        help="draft the N-th reading (default: the first)",
    )
    inspect.add_argument(
        "--out",
        type=Path,
        help=(
            "record to write, in the recording's folder or above (default: the file's name and "
            ".yaml, in the working directory if the recording lies below it, else next to the "
            "recording)"
        ),
    )
    meaning = (
        "simulate the radar of a record, train a network for it, and say which accuracy to expect"
    )
    train = add_command(
        actions, "train", _train, meaning, "lowalt recording train walk.yaml --out my_radar"
    )
    train.add_argument(
        "record",
        type=Path,
        help="record of a recording, or of a radar without one, with the block twin",
    )
    train.add_argument(
        "--out",
        type=Path,
        required=True,
        help="network to write, my_radar for my_radar.safetensors",
    )
    train.add_argument(
        "--recognition", default="config/measured/recognition.yaml", help="network and training"
    )


def _described(seen: Seen) -> str:
    """A reading in words."""
    keys = seen.keys
    words = []
    if "variable" in keys:
        words.append(f"variable {keys['variable']}")
    if "dtype" in keys:
        words.append(keys["dtype"])
    if keys["channel"] == "real":
        words.append("one real channel")
    elif "layout" in keys:
        words.append(WORDS[keys["layout"]])
    elif "columns" not in keys or len(keys["columns"]) == 1:
        words.append("complex samples")
    if "columns" in keys:
        words.append(f"columns {', '.join(map(str, keys['columns']))}")
    if "chirps" in keys:
        words.append(f"chirps of {keys['chirps']['samples']} samples")
        if keys["chirps"].get("receivers", 1) > 1:
            words.append(f"of {keys['chirps']['receivers']} receivers")
    return ", ".join(words)


def _line(inspection: FileInspection, seen: Seen) -> str:
    """A reading's strongest line in words."""
    speed = inspection.speed_mps(seen)
    if not inspection.rate_hz:
        return f"{seen.line_hz:+.4f} of the rate"
    hertz = f"{seen.line_hz:+.1f} Hz" if seen.values.dtype.kind == "c" else f"{seen.line_hz:.1f} Hz"
    if math.isnan(speed):
        return hertz
    return (
        f"{hertz} = {speed:+.2f} m/s"
        if seen.values.dtype.kind == "c"
        else f"{hertz} = {speed:.2f} m/s, sign lost"
    )


def drafted(inspection: FileInspection, seen: Seen, folder: Path) -> str:
    """Return the text of a record of a reading, relative to the folder that it is written to;
    guesses are marked.

    Raises: InputError where the recording does not lie in that folder or below.
    """
    mark = "" if seen.said else f"  # GUESSED: fits its samples best, {seen.bits:.2f} bits a byte"
    recording = inspection.path.resolve()
    if not recording.is_relative_to(folder.resolve()):
        raise InputError(
            f"--out: the folder {folder} is not that of {inspection.path}, expected a record in the"
            " recording's folder or above"
        )
    path = recording.relative_to(folder.resolve()).as_posix()
    lines = [
        "# Confirm the lines marked GUESSED.",
        f"file: {path!r}",
        f"carrier_hz: {inspection.carrier_hz:.9g}",
    ]
    chirps = "chirps" in seen.keys
    lines.append(f"rate_hz: {inspection.rate_hz:.9g}" + ("  # chirps a second" if chirps else ""))
    for key, value in seen.keys.items():
        text = (
            "{" + ", ".join(f"{name}: {item}" for name, item in value.items()) + "}"
            if key == "chirps"
            else value
        )
        lines.append(f"{key}: {list(value) if key == 'columns' else text}{mark}")
    waveform = "fmcw" if chirps else "cw"
    lines += [
        "# For `lowalt recording train`, with your own figures (m, m, degrees):",
        f"# twin: {{waveform: {waveform}, distance_m: [2, 10], height_m: [-1, 2], beam_deg: 60}}",
    ]
    return _with_first_line("\n".join(lines) + "\n")


def _with_first_line(body: str) -> str:
    """A draft of these lines; the checksum in its first line shows whether anybody edited them."""
    return f"{DRAFTED}, checksum {zlib.crc32(body.encode()):08x}.\n{body}"


def _refuse_to_write_over(out: Path) -> None:
    """Refuse a file that is no draft, or a draft that somebody edited."""
    if not out.is_file():
        return
    text = out.read_text(errors="replace")
    if text != _with_first_line(text.partition("\n")[2]):
        raise InputError(
            f"{out}: is there already and no draft as it was written, expected --out with another "
            "name"
        )


def _next(inspection: FileInspection, seen: Seen, out: Path) -> str:
    """The command to type next."""
    missing = [
        f"--{name.removesuffix('_hz')} HZ"
        for name in ("carrier_hz", "rate_hz")
        if not getattr(inspection, name)
    ]
    if missing:
        return f"lowalt recording inspect {shlex.quote(str(inspection.path))} {' '.join(missing)}"
    from lowalt.extensions.recordings.twin import radars

    names = [
        name
        for name, twin in radars().items()
        if inspection.carrier_hz
        and twin.near(inspection.carrier_hz)
        and (twin.channel == "real" or seen.keys["channel"] == "complex")
    ]
    if names:
        return f"lowalt predict {names[0]} {shlex.quote(str(out))}"
    return f"lowalt recording train {shlex.quote(str(out))} --out my_radar"


def _draft_path(recording: Path) -> Path:
    """Return the path of the record that is drafted for a recording.

    It lies in the working directory if the recording lies there or below, else next to the
    recording, because a record may not name a file outside of its own folder.
    """
    name = f"{recording.stem}.yaml"
    real = recording.resolve()
    return Path(name) if real.is_relative_to(Path.cwd()) else real.with_name(name)


def _inspect(options: argparse.Namespace) -> Answer:
    """Inspect a recording, draw it and draft its record."""
    from lowalt.extensions.recordings.recording_picture import recording_picture

    inspection = inspect_recording(options.file, options.carrier, options.rate)
    count = len(inspection.readings)
    if not 1 <= options.take <= count:
        raise InputError(f"--take is {options.take}, expected 1 to {count}, a reading of the list")
    seen = inspection.readings[options.take - 1]
    out = options.out or _draft_path(inspection.path)
    ready = bool(inspection.carrier_hz and inspection.rate_hz)
    if ready:
        _refuse_to_write_over(out)
    picture = Path(f"{options.file.stem}-inspect.png")
    write_file(
        picture, recording_picture(inspection, [_described(one) for one in inspection.readings])
    )
    text = drafted(inspection, seen, out.parent) if ready else None
    if text:
        write_file(out, text)
    then = _next(inspection, seen, out)
    facts = {
        "path": inspection.path,
        "carrier_hz": inspection.carrier_hz,
        "rate_hz": inspection.rate_hz,
        "readings": [
            {
                "keys": one.keys,
                "bits": one.bits,
                "said": one.said,
                "line_hz": one.line_hz,
                "line_mps": inspection.speed_mps(one),
            }
            for one in inspection.readings
        ],
        "notes": inspection.notes,
        "picture": picture,
        "file": out if text else None,
        "text": text,
        "next": then,
    }
    rows = [
        f"{number}  {_line(inspection, one):<32}  {_described(one)}"
        + (" (the file says so)" if one.said else "")
        for number, one in enumerate(inspection.readings, 1)
    ]
    lines = [
        f"{inspection.path}: readings, the best first, each with its strongest line",
        *rows,
        *(f"note: {note}" for note in inspection.notes),
        f"picture  {picture}",
    ]
    if text:
        lines.append(f"record   {out}, of reading {options.take}; another: --take N")
    return Answer(facts, "\n".join([*lines, f"next     {then}"]))


def _train(options: argparse.Namespace) -> Answer:
    """Train a network for the radar of a record."""
    from lowalt.extensions.recordings.own_radar import trained_radar
    from lowalt.extensions.recordings.record import read_record
    from lowalt.extensions.recordings.twin_training import settings

    record = read_record(shipped(options.record))
    facts = trained_radar(record, options.out.with_suffix(""), settings(options.recognition))
    each = ", ".join(
        f"{label} {percent:.0f}" for label, percent in facts["percent_by_class"].items()
    )
    then = f"lowalt predict {options.out.with_suffix('')} {options.record}"
    if not record.recorded:
        then = f"lowalt recording inspect FILE --carrier {record.carrier_hz:g}"
    lines = [
        (
            f"{facts['file']}: {facts['percent']:.1f} % of {facts['windows']} simulated windows"
            f" right ({each}), which no training saw; its mean probability is"
            f" {facts['mean_probability_percent']:.1f} %"
        ),
        (
            "Real recordings differ from their simulation: design/measured.md says by how much for "
            "three radars."
        ),
        f"next     {then}",
    ]
    return Answer(facts, "\n".join(lines))
