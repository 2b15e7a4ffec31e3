"""The range profiles of samples, made again from motion, clouds and noisy signals, for spectra that show them."""

from collections.abc import Mapping

import numpy as np

from lowalt.config.network import Network
from lowalt.echo import Rigid, range_profile
from lowalt.echo.scene import target
from lowalt.files.errors import InputError
from lowalt.motion import poses
from lowalt.noise.profile import noisy_profile
from lowalt.numerics.streams import stream
from lowalt.spectra import Spectra, spectrum
from lowalt.spectra.interface import OfProfiles
from lowalt.targets.cloud import Cloud, cloud_of


def profile_cells(spectra: Spectra, network: Network) -> int:
    """Return the number of range cells that the spectra show, 0 where none of them is made of profiles.

    Raises: InputError where these are more cells than the band has.
    """
    for name, settings in spectra.items():
        if isinstance(spectrum(name), OfProfiles):
            if settings.cells > network.subcarriers:
                raise InputError(
                    f"spectra.{name}.cells is {settings.cells}, expected at most the {network.subcarriers} of the band"
                )
            return settings.cells
    return 0


class Profiles:
    """Makes the noisy range profiles of samples; it keeps the clean ones of the last `kept` motion models."""

    def __init__(self, network: Network, clouds: Mapping[str, Cloud], seed: int, cells: int, kept: int = 1) -> None:
        """Take clouds by subtype, the root seed and the number of range cells."""
        self.network, self.clouds, self.seed, self.cells, self.kept = network, clouds, seed, cells, kept
        self._clean: dict[tuple, np.ndarray] = {}

    def clean(self, row: dict) -> np.ndarray:
        """Return the clean profiles (stations, symbols, cells) complex64 of a row of the motion table.

        Raises: InputError naming the sample that cannot be computed.
        """
        key = row["subtype"], row["model"]
        if key not in self._clean:
            while len(self._clean) >= self.kept:
                del self._clean[next(iter(self._clean))]
            self._clean[key] = self._seen(row)
        return self._clean[key]

    def _seen(self, row: dict) -> np.ndarray:
        """Compute `clean` for a row whose profiles are not kept."""
        sample, cloud = f"{row['subtype']}, model {row['model']}", cloud_of(self.clouds, row)
        moved = Rigid(*poses(cloud, row, self.network.times_s), cloud.points, cloud.part)
        seen, aim = target(moved, cloud.rcs_m2, sample), np.array([row["x_m"], row["y_m"], row["z_m"]])
        return np.stack([
            range_profile(self.network, station, seen, None, aim, self.cells, f"{sample}, station {station.name}")
            .values.astype(np.complex64)
            for station in self.network.stations
        ])  # fmt: skip

    def magnitudes(self, row: dict, snr_db: float, signals: np.ndarray) -> np.ndarray:
        """Return magnitudes (stations, cells, symbols) float32 of a sample's noisy profiles, the largest at most 1.

        signals: its noisy signals (stations, symbols), which are the middle cells; the noise of the other cells has a
        stream of its own for each subtype, model, station and SNR.
        Raises: InputError as `clean`.
        """
        name = row["subtype"], row["model"]
        result = np.empty((len(signals), self.cells, self.network.symbols), np.float32)
        for place, (station, profile) in enumerate(zip(self.network.stations, self.clean(row), strict=True)):
            rng = None if np.isposinf(snr_db) else stream(self.seed, "profile", *name, station.name, snr_db)
            found = noisy_profile(profile, signals[place], snr_db, rng).T
            # NumPy's |complex| differs between processors in its last bit; squares and a root do not.
            power = found.real * found.real + found.imag * found.imag
            largest = power.max()
            result[place] = np.sqrt(power / (largest if largest > 0 else 1.0))
        return result
