"""The raw echo of one target at one station, anywhere in the receiving chain, with the truth."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.machine.blas_threads import one_blas_thread
from lowalt.noise.awgn import add_noise
from lowalt.numerics.streams import stream
from lowalt.scene.chain import SceneSample
from lowalt.scene.truth import of_parts
from lowalt.shards.dataset import Dataset
from lowalt.shards.kept_datasets import dataset_of_subtype
from lowalt.spectra.cube import TRUTH
from lowalt.tiles.cubes import true_columns

AT = ("subcarriers", "receiver", "cells", "canceller", "signal")
"""The places of the chain at which an echo can be read, in the order in which it passes them."""


@dataclass(frozen=True, eq=False)
class RawEcho:
    """The echo of one target at one station; NumPy takes it as its `values`.

    values: (N, M) complex128 in sqrt(W), N symbols by M subcarriers or range cells; (N,) of the
    chosen signal.
    times_s: (N,) start of each symbol. frequencies_hz: (M,) of the subcarriers, or of the samples
    of an FMCW sweep;
    ranges_m: (M,) of the range cells; an axis that the values do not have is empty. speeds_mps:
    (N,) ascending, of a Fourier transform over the symbols.
    truth: what is true of the target's middle at each symbol, each (N,): range_m, radial_mps, psi,
    omega, cell, observed_cell and observed_mps (`lowalt.spectra.cube.TRUTH`), and of each part,
    each (N, P): part_range_m of its middle, part_low_mps and part_high_mps, the lowest and the
    highest radial speed of its points. parts: their names.
    companions: the subtypes of the other targets in the beam; others: what is true of each of
    them, the same quantities of `TRUTH`, each (C, N) of C companions in the order of their names.
    """

    values: np.ndarray
    times_s: np.ndarray
    frequencies_hz: np.ndarray
    ranges_m: np.ndarray
    speeds_mps: np.ndarray
    truth: dict[str, np.ndarray]
    parts: tuple[str, ...]
    companions: tuple[str, ...]
    others: dict[str, np.ndarray]
    subtype: str
    model: int
    station: str
    at: str
    snr_db: float
    unit: str = "sqrt(W)"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.values, dtype, copy=copy)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return everything by name, as a file holds it.

        These are the fields, each entry of the truth by its own name, and each of the companions'
        with `others_` before it.
        """
        result = {}
        for field in fields(self):
            if field.name not in ("truth", "others"):
                result[field.name] = np.asarray(getattr(self, field.name))
        result["companions"] = np.array(self.companions, dtype=np.str_)
        result |= self.truth
        for name, values in self.others.items():
            result[f"others_{name}"] = values
        return result


@one_blas_thread()
def receive(
    configuration: Dataset | dict | str | Path | Iterable[str | Path | dict],
    subtype: str,
    model: int = 0,
    station: str | None = None,
    at: str = "cells",
    snr_db: float = math.inf,
) -> RawEcho:
    """Return the echo of a motion model at a station, at one place of the chain, in sqrt(W).

    configuration: overlays on the embedded default, each a path or a dict, a whole configuration,
    or a `Dataset`; station: the first one by default. Only this target and the others that the
    scene adds are made. at: "subcarriers": Y[n, m] of Eq. 24, the known symbol removed, as a
    receiver without faults or noise finds it; "receiver": the same behind the receiver's effects
    and noise; "cells": range cells; "canceller": range cells behind the linear filters of the
    detection; "signal": the chosen range cell of each symbol.
    snr_db: without it there is no noise but that of the scene's own receiver; with it there is
    white noise from "receiver" on, and "canceller" and "signal" are those of the data set.

    Conventions: an echo of delay tau = 2 r / c is a exp(-j 2 pi f tau) at the frequency f, so it
    turns backwards from symbol to symbol as the target recedes; radial speeds are positive away
    from the station. Range cells are (1/M) sum_m Y[n, m] exp(+j 2 pi m r / M) (`numpy.fft.ifft`),
    cell r stands for the range c r / (2 M df); on a link ranges are half the way. Values of symbols
    that are not received are 0 in range cells.
    Raises: InputError naming the key or value that is wrong. Source: paper, Eq. 7, 24 and 25.

    A range-Doppler map in ten lines, speeds upwards:

        import lowalt, numpy as np, matplotlib.pyplot as plt
        scene = "config/scenes/urban.yaml"
        echo = lowalt.receive(scene, "Crow", model=3, station="A", at="canceller")
        window = np.hanning(len(echo.times_s))[:, None]
        power = abs(np.fft.fftshift(np.fft.fft(window * echo.values, axis=0), axes=0)[::-1]) ** 2
        plt.pcolormesh(echo.ranges_m, echo.speeds_mps, 10 * np.log10(power))
        plt.plot(echo.truth["range_m"], echo.truth["observed_mps"], "rx")
        plt.xlabel("range (m)"), plt.ylabel("radial speed (m/s)")
        plt.savefig("map.png")
    """
    if at not in AT:
        raise InputError(f"at is {at!r}, expected one of {list(AT)}")
    if not isinstance(model, (int, np.integer)) or model < 0:
        raise InputError(f"model is {model!r}, expected a whole number from 0")
    if not isinstance(configuration, Dataset):
        configuration = dataset_of_subtype(configuration, subtype)
    dataset: Dataset = configuration
    network = dataset.maker.network
    there = network.station(station or network.stations[0].name)
    row = dataset.row(dataset.place_of(subtype, int(model), snr_db))
    sample = dataset.maker.seen(row, snr_db, there)
    values = _values(dataset, sample, at, snr_db)
    return _described(values, sample, network, at, snr_db)


def _values(dataset: Dataset, sample: SceneSample, at: str, snr_db: float) -> np.ndarray:
    """The values at one place of the chain."""
    scene = sample.scene
    station = sample.view.station
    row = sample.view.row
    set_snr = math.isfinite(snr_db)
    if at == "subcarriers":
        ideal = tuple(
            effect for effect in scene.effects if effect.place not in ("receiver", "detection")
        )
        return SceneSample(replace(scene, effects=ideal), sample.view, sample.clouds).arrived()
    number = dataset.maker.network.stations.index(station)
    if set_snr and at in ("canceller", "signal"):
        signal = dataset.maker.signal(row, snr_db, [number])
        if at == "signal":
            return signal[number].astype(np.complex128)
        return dataset.maker.cubes(row, snr_db, signal, [number])[0].cells.astype(np.complex128)
    if at == "signal":
        return sample.received().signal
    if at == "receiver":
        values = sample.arrived()
    elif at == "cells":
        values = _of_all_symbols(sample, sample.cells)
    else:
        values = _of_all_symbols(sample, sample.filtered(sample.detection))
    if set_snr and not any(effect.offers("SET_SNR") for effect in scene.effects):
        rng = stream(scene.seed, "cells", row["subtype"], row["model"], station.name, snr_db)
        noise = add_noise(np.zeros(values.shape), snr_db, rng, sample.power)
        if at == "receiver":
            noise = np.fft.fft(noise, axis=1)
        values = values + noise
    return values


def _of_all_symbols(sample: SceneSample, received: np.ndarray) -> np.ndarray:
    """Range cells of all symbols, zeros at those that are not received."""
    view = sample.view
    result = np.zeros((len(view.times_s), received.shape[1]), np.complex128)
    if view.sampling is None:
        result[:] = received
    else:
        result[view.sampling.present] = received
    return result


def _described(
    values: np.ndarray, sample: SceneSample, network: Network, at: str, snr_db: float
) -> RawEcho:
    """The values with their axes and the truth."""
    view = sample.view
    station: Station = view.station
    frequencies_hz: np.ndarray = np.empty(0)
    if at in ("subcarriers", "receiver"):
        offsets_hz = np.arange(network.subcarriers) * network.subcarrier_spacing_hz
        frequencies_hz = station.frequency_hz + offsets_hz
    ranges_m: np.ndarray = np.empty(0)
    if at in ("cells", "canceller"):
        ranges_m = np.arange(values.shape[1]) * network.cell_m
    times_s = view.times_s
    if at == "signal" and all(even() for even in sample.all("even").values()):
        times_s = network.times_s
    truth = dict(zip(TRUTH, true_columns(sample, view).T, strict=True))
    of_each_part = ("part_range_m", "part_low_mps", "part_high_mps")
    truth |= dict(zip(of_each_part, of_parts(view), strict=True))
    companions = sample.targets[1:]
    of_companions = np.empty((len(companions), len(TRUTH), len(view.times_s)))
    for number, other in enumerate(companions):
        of_companions[number] = true_columns(sample, other).T
    return RawEcho(
        values=values,
        times_s=times_s,
        frequencies_hz=frequencies_hz,
        ranges_m=ranges_m,
        speeds_mps=network.bin_speeds_mps(len(values), station),
        truth=truth,
        parts=view.cloud.names,
        companions=tuple(other.row["subtype"] for other in companions),
        others={name: of_companions[:, number] for number, name in enumerate(TRUTH)},
        subtype=view.row["subtype"],
        model=int(view.row["model"]),
        station=station.name,
        at=at,
        snr_db=snr_db,
    )


def write(echo: RawEcho, path: Path) -> list[Path]:
    """Write an echo's arrays by name to `path`.npz, with h5py also `path`.h5; return the files."""
    written = [path.with_name(f"{path.name}.npz")]
    with replacing(written[0]) as temporary:
        np.savez(temporary, **echo.arrays())  # type: ignore[arg-type]
    try:
        import h5py
    except ImportError:
        return written
    written.append(path.with_name(f"{path.name}.h5"))
    with replacing(written[1]) as temporary, h5py.File(temporary, "w") as file:
        for name, array in echo.arrays().items():
            if array.dtype.kind == "U":
                array = array.astype(h5py.string_dtype())
            file[name] = array
    return written
