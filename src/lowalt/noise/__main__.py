"""Command line of the noise stage: clean echoes of a chunk -> noisy signals at all SNRs.

Echoes are given in a file per station.
"""

import sys

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.files.array_files import array_of
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.motion import read_table
from lowalt.noise.awgn import noisy_signals


def load_echoes(
    paths: list[str], stations: list[str], models: int, snrs: int | None = None
) -> list[np.ndarray]:
    """Return the clean echoes of a chunk as memory maps, one (models, symbols) per station.

    snrs: number of SNRs; echoes may also be (models, snrs, symbols), which already contain the
    noise.

    Raises: InputError naming the file that is missing, or that does not fit stations, models or the
    other files.
    """
    if len(paths) != len(stations):
        raise InputError(
            f"--echoes: {len(paths)} files, expected one for each station of {stations}"
        )
    echoes = [array_of(path, "echo", mapped=True) for path in paths]
    for path, echo in zip(paths, echoes, strict=True):
        fits = echo.ndim == 2 or (echo.ndim == 3 and echo.shape[1] == snrs)
        if not fits or len(echo) != models or echo.shape != echoes[0].shape:
            raise InputError(
                f"{path}: shape {echo.shape}, expected ({models}, symbols) as the motion table and "
                "others"
            )
    return echoes


def load_powers(paths: list[str], stations: list[str], models: int) -> np.ndarray:
    """Return the powers (W) that SNRs refer to, (stations, models) float64.

    Raises: InputError naming the file that is missing, or where files and stations or models do not
    fit.
    """
    if len(paths) != len(stations):
        raise InputError(
            f"--powers: {len(paths)} files, expected one for each station of {stations}"
        )
    powers = np.stack([array_of(path, "power") for path in paths])
    if powers.shape != (len(stations), models):
        raise InputError(f"--powers: shape {powers.shape}, expected ({len(stations)}, {models})")
    return powers


def main(arguments: list[str]) -> None:
    """Add noise to one chunk's echoes and write one array file."""
    options = parser("lowalt.noise", __doc__)
    options.add_argument("--motion", required=True, help="the chunk's motion table")
    options.add_argument(
        "--echoes", nargs="+", required=True, help="clean echoes, one file per station"
    )
    options.add_argument(
        "--powers", nargs="+", help="powers that SNRs refer to (.npy), one file per station"
    )
    options.add_argument("--out", required=True, help="noisy signals to write (.npy)")
    given = options.parse_args(arguments)
    filters = given.settings.pop("filters", None)
    filtered = None
    if filters:
        from lowalt.scene.set_noise import filtering

        filtered = filtering(filters)
    seed, stations, snrs = pick(given.settings, "seed", "stations", "snr_db")
    rows = read_table(given.motion)
    echoes = load_echoes(given.echoes, stations, len(rows), len(snrs))
    powers = None
    if given.powers:
        powers = load_powers(given.powers, stations, len(rows))
    levels = [float(snr) for snr in snrs]
    result = noisy_signals(np.stack(echoes), rows, stations, levels, seed, powers, filtered)
    with replacing(given.out, result.nbytes) as temporary:
        np.save(temporary, result)
    print(f"{given.out}: {result.shape[0] * result.shape[1]} samples", file=sys.stderr)


if __name__ == "__main__":
    run(main)
