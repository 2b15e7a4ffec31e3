"""Makes one sample from a row of the motion table and the target's cloud: echo, noise, image.

It applies the functions of the stages to one row, so its bytes equal those that the stages write.
"""

import functools
from collections.abc import Mapping, Sequence

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.echo.chunk import clean_signals
from lowalt.noise.awgn import noisy_signals
from lowalt.scene.chain import SceneSample, scene_signals
from lowalt.scene.effects import called
from lowalt.scene.lateness import lateness
from lowalt.scene.observe import Scene
from lowalt.scene.set_noise import filtering, filters, in_all_cells
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
"""Default number of motion models whose clean echoes (10 kB each) are cached for all their SNRs."""


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
        """Take settings, the random seed and clouds by subtype.

        render: the settings {network, spectra, images}; echo: {tolerance, effects}; occluders: each
        subtype's surfaces, where the scene hides points behind them.
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
        kept = {**self.__dict__, "_received": {}}
        kept.pop("renderer", None)
        kept.pop("_cubes", None)
        return kept

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
        """Return the cube of each station of a sample of the motion model `row` at an SNR (dB).

        signal: its noisy signals (stations, symbols); stations: numbers of those to make, all by
        default. Raises: InputError naming the sample that cannot be computed.
        """
        made = []
        for number in self._numbers(stations):
            made.append(self._cubes.of(row, snr_db, self.network.stations[number], signal[number]))
        return made

    def _numbers(self, stations: Sequence[int] | None) -> Sequence[int]:
        """The numbers of some stations, those of all stations for None."""
        if stations is None:
            return range(len(self.network.stations))
        return stations

    def seen(self, row: dict, snr_db: float, station: Station) -> SceneSample:
        """Return the motion model `row` as a station of the scene sees it, at an SNR (dB)."""
        return self._cubes.sample(row, snr_db, station)

    def shown(self, row: dict, snr_db: float, signal: np.ndarray) -> list[Cube] | None:
        """Return the cubes of `cubes` where a spectrum is made of range cells, otherwise None."""
        if not of_cells(self.render["spectra"]):
            return None
        return self.cubes(row, snr_db, signal)

    def received(
        self, row: dict, snr_db: float | None = None, stations: Sequence[int] | None = None
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Return a motion model's clean echoes (stations, symbols) complex64 and powers for SNRs.

        The powers (stations, 1) W are what SNRs refer to, None if they are the powers of the
        echoes. With an SNR (dB), the echoes include the noise of all range cells. stations:
        numbers of those to compute, all by default.
        Raises: InputError naming the sample that cannot be computed.
        """
        chosen = tuple(self._numbers(stations))
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
        """Compute `received` for a motion model whose echoes are not kept, at some stations."""
        tolerance = self.echo["tolerance"]
        if not self.echo["effects"]:
            return clean_signals(self.network, names, self.clouds, [row], tolerance)[:, 0], None
        scene = Scene(self.network, self.seed, tolerance, tuple(called(self.echo["effects"])))
        if snr_db is not None:
            scene = scene.at_snr(snr_db)
        echoes = []
        powers = []
        for name in names:
            signals, power = scene_signals(scene, name, self.clouds, [row], self.occluders)
            echoes.append(signals[0])
            powers.append(power)
        return np.stack(echoes), np.stack(powers)

    def signal(self, row: dict, snr_db: float, stations: Sequence[int] | None = None) -> np.ndarray:
        """Return the noisy signals of one sample, (stations, symbols) complex64.

        stations: numbers of those to compute, in increasing order; the signals of the others are
        zeros.
        Raises: InputError naming the sample that cannot be computed.
        """
        chosen = list(self._numbers(stations))
        result = np.zeros((len(self.network.stations), self.network.symbols), np.complex64)
        result[chosen] = self._noisy(row, snr_db, chosen)
        return result

    def _noisy(self, row: dict, snr_db: float, stations: Sequence[int]) -> np.ndarray:
        """The noisy signals of one sample at some stations."""
        effects = self.echo["effects"]
        if in_all_cells(effects):
            return self.received(row, snr_db, stations)[0]
        clean, powers = self.received(row, None, stations)
        names = self._names(stations)
        echoes = clean[:, None]
        filtered = filtering(filters(effects))
        signals = noisy_signals(echoes, [row], names, [snr_db], self.seed, powers, filtered)
        return signals[0, 0]

    def late(self, row: dict) -> np.ndarray | None:
        """Return the delays of a model's symbols, (stations, symbols), None if no image uses them."""
        return lateness(self.render["spectra"], self.echo["effects"], self.network, self.seed, row)

    def tile(self, signal: np.ndarray, row: dict, snr_db: float) -> np.ndarray:
        """Return the tile of one sample of the motion model `row` at an SNR (dB).

        signal: (stations, symbols).
        """
        cubes = self.shown(row, snr_db, signal)
        return self.renderer.tile(signal, late=self.late(row), cubes=cubes)

    def png(self, signal: np.ndarray, row: dict, snr_db: float) -> bytes:
        """Return the PNG file of the tile of one sample, as `tile`."""
        return encode(self.tile(signal, row, snr_db), self.images.palette)

    def data(
        self, kind: str, signal: np.ndarray, row: dict, snr_db: float, cell_type: str
    ) -> tuple[bytes, dict]:
        """Return the data of one sample as in a shard of a kind, and its record's part on cubes.

        kind: "image", "cube", or "signal" and "recipe", which hold the same; signal: (stations,
        symbols); cell_type: type of the stored cells of cubes, "complex64" or "int16".
        """
        if kind == "image":
            return self.png(signal, row, snr_db), {}
        if kind == "cube":
            return of_cubes(self.cubes(row, snr_db, signal), self.network, cell_type)
        return npy(signal), {}
