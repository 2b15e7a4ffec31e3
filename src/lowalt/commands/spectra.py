"""The command `lowalt spectra`: settings and sources of the spectra, and the time per image."""

import argparse
import functools
from dataclasses import asdict
from pathlib import Path

import numpy as np

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.blocks import render_blocks
from lowalt.config.layers import overlaid
from lowalt.machine.hardware import describe
from lowalt.machine.timing import median_s
from lowalt.spectra import spectrum, windows, zero_index
from lowalt.spectra.cube import Cube
from lowalt.spectra.interface import OfCells
from lowalt.tiles.render import Renderer, normalised

REPEATS = 5


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `spectra` to a parser's commands."""
    line = add_command(commands, name, run)
    line.add_argument("overlay", type=Path, nargs="*", help="overlays on the default")


def facts(config: dict) -> list[dict]:
    """Return the facts on each spectrum of a checked configuration.

    They are its size, the index of zero, the time of an image, its settings and its source.
    """
    renderer = Renderer.from_settings(render_blocks(config))
    symbols = renderer.network.symbols
    signal = normalised(np.exp(0.1j * np.arange(symbols) ** 1.5).astype(np.complex64))
    if renderer.spectra.times == "known":
        # Use a look with gaps: without gaps the kernels for evenly spaced symbols would be timed.
        signal[3::4] = 0
    image = np.empty((renderer.images.size, renderer.images.size), np.uint8)
    still = np.zeros(symbols, np.int64)
    no_truth = np.zeros((symbols, 0))
    rows = []
    for name, settings in renderer.spectra.items():
        kind = spectrum(name)
        received: np.ndarray | Cube
        if isinstance(kind, OfCells):
            count = kind.columns(settings, symbols)
            cells = np.repeat(signal[:, None], settings.cells, axis=1)
            received = Cube(cells, still, no_truth)
        else:
            count = windows(symbols, settings.window, settings.hop, name)
            received = signal
        draw = functools.partial(renderer.image, received, 0, name, image)
        draw()
        rows.append(
            {
                "name": name,
                "title": kind.TITLE,
                "rows": kind.rows(settings),
                "windows": count,
                "zero_index": zero_index(name),
                "image_ms": 1e3 * median_s(draw, REPEATS),
                "settings": asdict(settings),
                "source": kind.SOURCE,
            }
        )
    return rows


def run(options: argparse.Namespace) -> Answer:
    """Describe the spectra of a configuration. Raises: InputError for a wrong configuration."""
    rows = facts(overlaid(options.overlay))
    hardware = describe()
    lines = []
    for row in rows:
        values = ", ".join(f"{key} {value}" for key, value in row["settings"].items())
        lines += [
            f"{row['name']} ({row['title']}): {row['rows']} rows, {row['windows']} windows, "
            f"zero at index {row['zero_index']}, {row['image_ms']:.2f} ms per image | {values}",
            f"  {row['source']}",
        ]
    text = "\n".join([*lines, f"medians of {REPEATS}; {hardware}"])
    return Answer({"spectra": rows, "repeats": REPEATS, "hardware": hardware}, text)
