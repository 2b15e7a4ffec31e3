"""The action `lowalt spectra`: a configuration's spectra, their settings and sources, and the time of an image."""

import argparse
from dataclasses import asdict
from pathlib import Path

import numpy as np

from lowalt.common.config import load
from lowalt.common.hardware import describe
from lowalt.common.timing import median_s
from lowalt.spectra import spectrum, windows, zero_index
from lowalt.tiles.render import Renderer, normalised

REPEATS = 5


def add_to(commands: argparse._SubParsersAction, base: Path, schema: Path) -> None:
    """Add the action to the command `lowalt`; base: the configuration by default; schema: its schema."""
    line = commands.add_parser(
        "spectra", help="the spectra of a configuration, and the time an image of each takes",
        epilog="example: lowalt spectra config/tiny.yaml",
    )  # fmt: skip
    line.add_argument("overlay", type=Path, nargs="*", help="overlays on the base configuration")
    line.add_argument("--base", type=Path, default=base, help=f"base configuration (default: {base})")
    line.add_argument("--schema", type=Path, default=schema, help=f"its schema (default: {schema})")


def described(config: dict) -> str:
    """Return lines on each spectrum of a checked configuration: size, index of zero, time, settings, source."""
    renderer = Renderer.from_settings({key: config[key] for key in ("network", "spectra", "images")})
    symbols = renderer.network.symbols
    signal = normalised(np.exp(0.1j * np.arange(symbols) ** 1.5).astype(np.complex64))
    image = np.empty((renderer.images.size, renderer.images.size), np.uint8)
    lines = []
    for name, settings in renderer.spectra.items():
        kind = spectrum(name)
        count = windows(symbols, settings.window, settings.hop, name)
        renderer.image(signal, 0, name, image)
        ms = 1e3 * median_s(lambda name=name: renderer.image(signal, 0, name, image), REPEATS)
        values = ", ".join(f"{key} {value}" for key, value in asdict(settings).items())
        lines += [
            f"{name} ({kind.TITLE}): {kind.rows(settings)} rows, {count} windows, zero at index {zero_index(name)}, "
            f"{ms:.2f} ms an image | {values}",
            f"  {kind.SOURCE}",
        ]
    return "\n".join([*lines, f"medians of {REPEATS}; {describe()}"])


def run(given: argparse.Namespace) -> str:
    """Run the action and return its text. Raises: InputError where the configuration is wrong."""
    return described(load([given.base, *given.overlay], given.schema))
