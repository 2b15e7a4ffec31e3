"""Command line of the noise stage: clean echoes of a chunk, a file a station -> noisy signals at all SNRs."""

import sys

import numpy as np

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.files import existing, replacing
from lowalt.common.streams import stream
from lowalt.motion import read_table
from lowalt.noise.awgn import add_noise


def noisy_signals(
    echoes: np.ndarray,
    rows: list[dict],
    stations: list[str],
    snrs: list[float],
    seed: int,
    powers: np.ndarray | None = None,
) -> np.ndarray:
    """Return noisy signals (models, snrs, stations, N) complex64 of clean `echoes` (stations, models, N).

    rows: the motion table; powers: (stations, models) W that SNRs refer to, each echo's own by default.
    Each (subtype, model, station, SNR) has a noise stream of its own.
    """
    result = np.empty((len(rows), len(snrs), len(stations), echoes.shape[-1]), np.complex64)
    for model, row in enumerate(rows):
        for level, snr_db in enumerate(snrs):
            for place, name in enumerate(stations):
                rng = None if np.isposinf(snr_db) else stream(seed, "noise", row["subtype"], row["model"], name, snr_db)
                power = None if powers is None else float(powers[place, model])
                result[model, level, place] = add_noise(echoes[place, model], snr_db, rng, power)
    return result


def main(arguments: list[str]) -> None:
    """Add noise to one chunk's echoes and write one array file."""
    options = parser("lowalt.noise", __doc__)
    options.add_argument("--motion", required=True, help="the chunk's motion table")
    options.add_argument("--echoes", nargs="+", required=True, help="clean echoes, one file a station")
    options.add_argument("--powers", nargs="+", help="powers that SNRs refer to (.npy), one file a station")
    options.add_argument("--out", required=True, help="noisy signals to write (.npy)")
    given = options.parse_args(arguments)
    seed, stations, snrs = pick(given.settings, "seed", "stations", "snr_db")
    rows = read_table(given.motion)
    if len(given.echoes) != len(stations):
        raise InputError(f"--echoes: {len(given.echoes)} files, expected one for each station of {stations}")
    echoes = [np.load(existing(path, "echo"), mmap_mode="r") for path in given.echoes]
    for path, echo in zip(given.echoes, echoes, strict=True):
        if echo.ndim != 2 or len(echo) != len(rows) or echo.shape != echoes[0].shape:
            raise InputError(f"{path}: shape {echo.shape}, expected ({len(rows)}, symbols) as in {given.motion}")
    powers = None
    if given.powers:
        if len(given.powers) != len(stations):
            raise InputError(f"--powers: {len(given.powers)} files, expected one for each station of {stations}")
        powers = np.stack([np.load(existing(path, "power")) for path in given.powers])
        if powers.shape != (len(stations), len(rows)):
            raise InputError(f"--powers: shape {powers.shape}, expected ({len(stations)}, {len(rows)})")
    result = noisy_signals(np.stack(echoes), rows, stations, [float(snr) for snr in snrs], seed, powers)
    with replacing(given.out, result.nbytes) as temporary:
        np.save(temporary, result)
    print(f"{given.out}: {result.shape[0] * result.shape[1]} samples", file=sys.stderr)


if __name__ == "__main__":
    run(main)
