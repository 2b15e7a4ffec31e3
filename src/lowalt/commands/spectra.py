"""The action `lowalt spectra`: a configuration's spectra, their settings and sources, and the time of an image."""

import argparse
from dataclasses import asdict
from pathlib import Path

import numpy as np

from lowalt.commands.for_programs import acts, as_json
from lowalt.config.layers import overlaid
from lowalt.machine.hardware import describe
from lowalt.machine.timing import median_s
from lowalt.spectra import spectrum, windows, zero_index
from lowalt.spectra.cube import Cube
from lowalt.spectra.interface import OfCells
from lowalt.tiles.render import Renderer, normalised

REPEATS = 5


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add `spectra` to a parser's commands."""
    line = commands.add_parser(
        "spectra", help="the spectra of a configuration, and the time an image of each takes",
        epilog="example: lowalt spectra config/tiny.yaml",
    )  # fmt: skip
    line.add_argument("overlay", type=Path, nargs="*", help="overlays on the default")
    acts(line, run)


def facts(config: dict) -> list[dict]:
    """Return the facts on each spectrum of a checked configuration: size, index of zero, time, settings, source."""
    renderer = Renderer.from_settings({key: config[key] for key in ("network", "spectra", "images")})
    symbols = renderer.network.symbols
    signal = normalised(np.exp(0.1j * np.arange(symbols) ** 1.5).astype(np.complex64))
    if renderer.spectra.times == "known":
        # A look without gaps would take the time of even symbols.
        signal[3::4] = 0
    image = np.empty((renderer.images.size, renderer.images.size), np.uint8)
    still, no_truth = np.zeros(symbols, np.int64), np.zeros((symbols, 0))
    found = []
    for name, settings in renderer.spectra.items():
        kind = spectrum(name)
        cells = isinstance(kind, OfCells)
        count = kind.columns(settings, symbols) if cells else windows(symbols, settings.window, settings.hop, name)
        given = Cube(np.repeat(signal[:, None], settings.cells, axis=1), still, no_truth) if cells else signal
        renderer.image(given, 0, name, image)
        found.append({
            "name": name, "title": kind.TITLE, "rows": kind.rows(settings),
            "windows": count, "zero_index": zero_index(name),
            "image_ms": 1e3 * median_s(lambda name=name, given=given: renderer.image(given, 0, name, image), REPEATS),
            "settings": asdict(settings), "source": kind.SOURCE,
        })  # fmt: skip
    return found


def described(found: list[dict], hardware: str) -> str:
    """Return the facts on each spectrum as lines of text; hardware: of the machine that measured the times."""
    lines = []
    for one in found:
        values = ", ".join(f"{key} {value}" for key, value in one["settings"].items())
        lines += [
            f"{one['name']} ({one['title']}): {one['rows']} rows, {one['windows']} windows, "
            f"zero at index {one['zero_index']}, {one['image_ms']:.2f} ms an image | {values}",
            f"  {one['source']}",
        ]
    return "\n".join([*lines, f"medians of {REPEATS}; {hardware}"])


def run(given: argparse.Namespace) -> str:
    """Return the facts as text, or as JSON. Raises: InputError where the configuration is wrong."""
    found = facts(overlaid(given.overlay))
    if given.json:
        return as_json({"spectra": found, "repeats": REPEATS, "hardware": describe()})
    return described(found, describe())
