"""Makes one sample from a row of the motion table and the target's cloud: echo, noise, image.

It applies the functions of the stages to one row, so its bytes equal those that the stages write.
"""

import functools
from collections.abc import Mapping, Sequence

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.echo.chunk import clean_signals
from lowalt.noise.awgn import noisy_signals
from lowalt.scene.chain import SceneSample
from lowalt.scene.lateness import lateness
from lowalt.scene.set_noise import behind, filters, in_all_cells
from lowalt.shards.sample_record import npy
from lowalt.shards.stored_cubes import of_cubes
from lowalt.spectra import Spectra
from lowalt.spectra.catalogue import of_cells
from lowalt.spectra.cube import Cube
from lowalt.targets.cloud import Cloud
from lowalt.tiles.cubes import Cubes
from lowalt.tiles.image_settings import Images
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer

KEPT = 16
"""Default number of motion models whose clean echoes are cached (10 kB each), for use at all their
SNRs.
"""


class Maker:
    """Makes samples of one configuration and caches the clean echoes of the last motion models."""

    def __init__(
        self,
        render: dict,
        echo: dict,
        seed: int,
        clouds: Mapping[str, Cloud],
        occluders: Mapping[str, dict] | None = None,
    ) -> None:
        """Take the settings {network, spectra, images} and {tolerance, effects}, the random seed
        and clouds by subtype.

        occluders: each subtype's surfaces, where the scene hides points behind them.
        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        self.render = render
        self.echo = echo
        self.seed = seed
        self.clouds = clouds
        self.occluders = occluders
        self.network = Network.from_settings(render["network"])
        self.kept = KEPT
        self.images = Images.from_settings(render["images"])
        self._received: dict[tuple, tuple[np.ndarray, np.ndarray | None]] = {}

    def __getstate__(self) -> dict:
        """State for pickle, without tables and kept echoes."""
        # Each worker computes its own tables.
        kept = {
            name: value
            for name, value in self.__dict__.items()
            if name not in ("renderer", "_cubes")
        }
        return {**kept, "_received": {}}

    @functools.cached_property
    def renderer(self) -> Renderer:
        """The renderer that turns signals into tiles."""
        return Renderer(self.network, Spectra.from_settings(self.render["spectra"]), self.images)

    @functools.cached_property
    def _cubes(self) -> Cubes:
        """The maker of the cubes of samples."""
        scene = {"seed": self.seed, "network": self.render["network"], **self.echo}
        return Cubes.from_settings(scene, self.clouds, self.occluders)

    def cubes(
        self, row: dict, snr_db: float, signal: np.ndarray, stations: Sequence[int] | None = None
    ) -> list[Cube]:
        """Return the cube of each station of a sample of the motion model `row` at an SNR (dB);
        signal: its noisy signals (stations, symbols); stations: numbers of those to make, all by
        default.

        Raises: InputError naming the sample that cannot be computed.
        """
        chosen = range(len(self.network.stations)) if stations is None else stations
        return [
            self._cubes.of(row, snr_db, self.network.stations[number], signal[number])
            for number in chosen
        ]

    def seen(self, row: dict, snr_db: float, station: Station) -> SceneSample:
        """Return the motion model `row` as a station of the scene sees it, at an SNR (dB)."""
        return self._cubes.sample(row, snr_db, station)

    def shown(self, row: dict, snr_db: float, signal: np.ndarray) -> list[Cube] | None:
        """Return the cubes that images are made of, as `cubes`; None where no spectrum is made of
        range cells.
        """
        return self.cubes(row, snr_db, signal) if of_cells(self.render["spectra"]) else None

    def received(
        self, row: dict, snr_db: float | None = None, stations: Sequence[int] | None = None
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Return a motion model's clean echoes (stations, symbols) complex64 and the reference
        powers (stations, 1) W of SNRs, None if these are the powers of the echoes. With an SNR
        (dB), the echoes include the noise of all range cells. stations: numbers of those to
        compute, all by default.

        Raises: InputError naming the sample that cannot be computed.
        """
        chosen = tuple(range(len(self.network.stations)) if stations is None else stations)
        key = row["subtype"], row["model"], snr_db, chosen
        if key not in self._received:
            if len(self._received) >= self.kept:
                del self._received[next(iter(self._received))]
            self._received[key] = self._listen(row, snr_db, self._names(chosen))
        return self._received[key]

    def _names(self, stations: Sequence[int]) -> list[str]:
        """Names of stations by number."""
        return [self.network.stations[number].name for number in stations]

    def _listen(
        self, row: dict, snr_db: float | None, names: list[str]
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Compute `received` for a motion model whose echoes are not kept, at the stations `names`."""
        tolerance = self.echo["tolerance"]
        if not self.echo["effects"]:
            return clean_signals(self.network, names, self.clouds, [row], tolerance)[:, 0], None
        from lowalt.scene.chain import scene_signals
        from lowalt.scene.effects import called
        from lowalt.scene.observe import Scene

        scene = Scene(self.network, self.seed, tolerance, tuple(called(self.echo["effects"])))
        if snr_db is not None:
            scene = scene.at_snr(snr_db)
        heard = [scene_signals(scene, name, self.clouds, [row], self.occluders) for name in names]
        return np.stack([signal[0] for signal, _ in heard]), np.stack([power for _, power in heard])

    def signal(self, row: dict, snr_db: float, stations: Sequence[int] | None = None) -> np.ndarray:
        """Return the noisy signals of one sample, (stations, symbols) complex64.

        stations: numbers of those to compute, in increasing order; the signals of the others are
        zeros.
        Raises: InputError naming the sample that cannot be computed.
        """
        every = range(len(self.network.stations))
        chosen = list(every if stations is None else stations)
        result = np.zeros((len(every), self.network.symbols), np.complex64)
        result[chosen] = self._noisy(row, snr_db, chosen)
        return result

    def _noisy(self, row: dict, snr_db: float, stations: Sequence[int]) -> np.ndarray:
        """The noisy signals of one sample at some stations."""
        effects = self.echo["effects"]
        if in_all_cells(effects):
            return self.received(row, snr_db, stations)[0]
        passed = filters(effects)
        filtered = functools.partial(behind, filters=passed) if passed else None
        clean, powers = self.received(row, None, stations)
        return noisy_signals(
            clean[:, None], [row], self._names(stations), [snr_db], self.seed, powers, filtered
        )[0, 0]

    def late(self, row: dict) -> np.ndarray | None:
        """Return the delays of a motion model's symbols, (stations, symbols); None if images do not
        use them.
        """
        return lateness(self.render["spectra"], self.echo["effects"], self.network, self.seed, row)

    def tile(self, signal: np.ndarray, row: dict, snr_db: float) -> np.ndarray:
        """Return the tile of one sample of the motion model `row` at an SNR (dB); signal:
        (stations, symbols).
        """
        return self.renderer.tile(
            signal, late=self.late(row), cubes=self.shown(row, snr_db, signal)
        )

    def png(self, signal: np.ndarray, row: dict, snr_db: float) -> bytes:
        """Return the PNG file of the tile of one sample of the motion model `row` at an SNR (dB)."""
        return encode(self.tile(signal, row, snr_db), self.images.palette)

    def data(
        self, kind: str, signal: np.ndarray, row: dict, snr_db: float, cell_type: str
    ) -> tuple[bytes, dict]:
        """Return the data of one sample as a shard of a kind holds it, and what its record says of
        its cubes.

        kind: "image", "cube", or "signal" and "recipe", which hold the same; signal: (stations,
        symbols);
        cell_type: type of the stored cells of cubes, "complex64" or "int16".
        """
        if kind == "image":
            return self.png(signal, row, snr_db), {}
        if kind == "cube":
            return of_cubes(self.cubes(row, snr_db, signal), self.network, cell_type)
        return npy(signal), {}
