"""How many tries `lowalt recording inspect` needs for a file of unknown layout: the place of the true reading.

    python benchmarks/recording_layouts.py --out results/benchmarks/recording_layouts.csv

Simulated echoes in noise (a point at one speed, a walker, a drone's body and rotors; a leak is always there) are
written as receivers write them. A reading is right where it gives back the samples that were written, up to a factor,
and of chirps the slow signal. Rate and carrier are told, nothing else.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
from scipy.io import savemat, wavfile

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.file_inspection import inspect_recording
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError

CARRIER_HZ, RATE_HZ, COUNT, SPEED_MPS = 3.3e9, 5000.0, 8192, 3.0
WAVE_M = SPEED_OF_LIGHT / CARRIER_HZ
SNRS_DB = (30, 10, 0)
COLUMNS = ("layout", "echo", "snr_db", "tries")


def echo(kind: str, snr_db: float, rng: np.random.Generator) -> np.ndarray:
    """Return the samples (COUNT,) of an echo of unit power, "point", "walker" or "drone", in noise, with a leak."""
    times = np.arange(COUNT) / RATE_HZ
    range_m = 20 - SPEED_MPS * times
    parts = {
        "point": [(1.0, range_m)],
        "walker": [(1.0, range_m), *((0.4, range_m + 0.15 * np.sin(2 * np.pi * 1.8 * times + phase))
                                     for phase in (0, 3))],
        "drone": [(1.0, range_m), *((0.3, range_m + reach * np.cos(2 * np.pi * rate * times + rate))
                                    for rate in (80.0, 82.0, 79.0, 85.0) for reach in (0.04, 0.07, 0.1))],
    }  # fmt: skip
    signal = sum(size * np.exp(-4j * np.pi * distance / WAVE_M) for size, distance in parts[kind])
    signal /= np.sqrt(np.mean(np.abs(signal) ** 2))
    noise = rng.standard_normal((2, COUNT)) * np.sqrt(0.5) * 10 ** (-snr_db / 20)
    return signal + noise[0] + 1j * noise[1] + 0.6


def in_turn(*columns: np.ndarray) -> np.ndarray:
    """Columns (n,) value by value."""
    return np.stack(columns, axis=1).ravel()


def sigmf(folder: Path, name: str, numbers: np.ndarray, dtype: str) -> Path:
    """Write a SigMF recording and return its metadata's path."""
    numbers.tofile(folder / f"{name}.sigmf-data")
    about = {"core:datatype": dtype, "core:sample_rate": RATE_HZ, "core:version": "1.0.0"}
    captures = [{"core:sample_start": 0, "core:frequency": CARRIER_HZ}]
    text = json.dumps({"global": about, "captures": captures, "annotations": []})
    path = folder / f"{name}.sigmf-meta"
    path.write_text(text)
    return path


def mat73(path: Path, values: np.ndarray) -> Path:
    """Write a MATLAB file of version 7.3."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        pair = np.empty(len(values), [("real", "f8"), ("imag", "f8")])
        pair["real"], pair["imag"] = values.real, values.imag
        file.create_dataset("iq", data=pair.reshape(-1, 1))
    return path


def chirped(values: np.ndarray, samples: int = 64, beat: float = 0.11) -> np.ndarray:
    """Chirps (512 * samples,) of a target with the slow signal `values`: a beat note of conjugate phase, clutter."""
    fast = np.exp(2j * np.pi * beat * np.arange(samples))
    still = 2 * np.exp(2j * np.pi * 0.031 * np.arange(samples))
    return (values[:512, None].conj() * fast + still).ravel()


def written(layout: str, values: np.ndarray, folder: Path) -> Path:
    """Write samples (n,) complex in a layout of `LAYOUTS` and return the file's path."""
    return LAYOUTS[layout](folder, values, np.round(3000 * values.real), np.round(3000 * values.imag))


def raw(folder: Path, name: str, numbers: np.ndarray, dtype: str) -> Path:
    """Write numbers without a header."""
    path = folder / name
    numbers.astype(dtype).tofile(path)
    return path


def table(folder: Path, header: str, *columns: np.ndarray) -> Path:
    """Write a CSV file."""
    path = folder / "columns.csv"
    np.savetxt(path, np.stack(columns, axis=1), "%.6f", ",", header=header, comments="")
    return path


def complex_cells(folder: Path, values: np.ndarray) -> Path:
    """Write a CSV file of complex cells."""
    path = folder / "cells.csv"
    path.write_text("\n".join(f"{value.real:.5f}{value.imag:+.5f}j" for value in values) + "\n")
    return path


def array(folder: Path, values: np.ndarray) -> Path:
    """Write a NumPy file."""
    np.save(folder / "array.npy", values)
    return folder / "array.npy"


def wav(folder: Path, values: np.ndarray) -> Path:
    """Write a WAV file."""
    wavfile.write(folder / "stereo.wav", int(RATE_HZ), values.astype(np.int16))
    return folder / "stereo.wav"


def mat5(folder: Path, values: np.ndarray) -> Path:
    """Write a MATLAB file of version 5."""
    savemat(folder / "five.mat", {"iq": values, "fs": RATE_HZ})
    return folder / "five.mat"


LAYOUTS = {
    "CSV I,Q": lambda f, v, i, q: table(f, "I,Q", v.real, v.imag),
    "CSV Q,I": lambda f, v, i, q: table(f, "Q,I", v.imag, v.real),
    "CSV without names": lambda f, v, i, q: table(f, "", v.real, v.imag),
    "CSV t,I,Q": lambda f, v, i, q: table(f, "t,I,Q", np.arange(len(v)) / RATE_HZ, v.real, v.imag),
    "CSV mag,phase": lambda f, v, i, q: table(f, "mag,phase", np.abs(v), np.angle(v)),
    "CSV complex": lambda f, v, i, q: complex_cells(f, v),
    "NumPy complex": lambda f, v, i, q: array(f, v.astype(np.complex64)),
    "NumPy int16 iqiq": lambda f, v, i, q: array(f, in_turn(i, q).astype(np.int16)),
    "NumPy (n, 2)": lambda f, v, i, q: array(f, np.stack([v.real, v.imag], axis=1)),
    "NumPy chirps": lambda f, v, i, q: array(f, chirped(v).reshape(-1, 64)),
    "int16 iqiq": lambda f, v, i, q: raw(f, "a.bin", in_turn(i, q), "<i2"),
    "int16 iiqq": lambda f, v, i, q: raw(f, "a.bin", np.r_[i, q], "<i2"),
    "int16 big-endian": lambda f, v, i, q: raw(f, "a.bin", in_turn(i, q), ">i2"),
    "int16 dca2": lambda f, v, i, q: raw(f, "a.bin", in_turn(i[::2], i[1::2], q[::2], q[1::2]), "<i2"),
    "int16 dca4": lambda f, v, i, q: raw(f, "a.bin", in_turn(*(np.roll(i, 40 * k) for k in range(4)),
                                                             *(np.roll(q, 40 * k) for k in range(4))), "<i2"),
    "int16 dca2 chirps": lambda f, v, i, q: raw(f, "a.bin", dca2(np.round(3000 * chirped(v))), "<i2"),
    "uint8 iqiq": lambda f, v, i, q: raw(f, "a.bin", np.clip(127.5 + in_turn(i, q) / 100, 0, 255), "u1"),
    "uint8 .cu8": lambda f, v, i, q: raw(f, "a.cu8", np.clip(127.5 + in_turn(i, q) / 100, 0, 255), "u1"),
    "int8 iqiq": lambda f, v, i, q: raw(f, "a.iq", np.clip(in_turn(i, q) / 100, -128, 127), "i1"),
    "int8 .cs8": lambda f, v, i, q: raw(f, "a.cs8", np.clip(in_turn(i, q) / 100, -128, 127), "i1"),
    "float32 iqiq": lambda f, v, i, q: raw(f, "a.bin", in_turn(v.real, v.imag), "<f4"),
    "float32 .cfile": lambda f, v, i, q: raw(f, "a.cfile", in_turn(v.real, v.imag), "<f4"),
    "stereo WAV": lambda f, v, i, q: wav(f, np.stack([i, q], axis=1)),
    "MATLAB 5": lambda f, v, i, q: mat5(f, v),
    "MATLAB 7.3": lambda f, v, i, q: mat73(f / "seven.mat", v),
    "SigMF int16": lambda f, v, i, q: sigmf(f, "a", in_turn(i, q).astype("<i2"), "ci16_le"),
    "SigMF float32": lambda f, v, i, q: sigmf(f, "b", in_turn(v.real, v.imag).astype("<f4"), "cf32_le"),
}  # fmt: skip


def dca2(values: np.ndarray) -> np.ndarray:
    """Complex samples in the order of a DCA1000 with two lanes."""
    return in_turn(values.real[::2], values.real[1::2], values.imag[::2], values.imag[1::2])


def tries(path: Path, values: np.ndarray) -> int:
    """Return the place, from 1, of the first reading of a file that gives back the samples; 99 where none does."""
    try:
        seen = inspect_recording(path, CARRIER_HZ, RATE_HZ)
    except InputError:
        return 99
    truth = values - values.mean()
    for number, one in enumerate(seen.readings, 1):
        found = one.values - one.values.mean()
        if "chirps" in one.keys:
            truth = values[: len(found)] - values[: len(found)].mean()
        if len(found) == len(truth) and np.iscomplexobj(found):
            alike = abs(np.vdot(found, truth)) / (np.linalg.norm(found) * np.linalg.norm(truth))
            if alike > 0.95:
                return number
    return 99


def main() -> None:
    """Write the table and print how many files need one try, two, or more."""
    line = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    line.add_argument("--out", type=Path, required=True, help="table to write (.csv)")
    options = line.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for layout in LAYOUTS:
            for kind in ("point", "walker", "drone"):
                for snr in SNRS_DB:
                    values = echo(kind, snr, np.random.default_rng([snr, len(kind)]))
                    rows.append([layout, kind, snr, tries(written(layout, values, Path(folder)), values)])
    write_csv(options.out, COLUMNS, rows)
    counts = [row[-1] for row in rows]
    print(f"{len(rows)} files: {counts.count(1)} at the first try, {counts.count(2)} at the second, "
          f"{sum(count > 2 for count in counts)} later")  # fmt: skip
    for row in rows:
        if row[-1] > 2:
            print(*row)


if __name__ == "__main__":
    main()
