"""Command line of the noise stage: clean echoes of a chunk, a file a station -> noisy signals at all SNRs."""

import sys

import numpy as np

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.files import existing, replacing
from lowalt.motion import read_table
from lowalt.noise.chunk import noisy_signals


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
