"""The radar's twin: a measured radar as a configuration of the same engine.

A continuous-wave radar is a network of one station with one subcarrier and single elements. Its receiver gives a
complex channel, or one real channel of which only the real part is kept.
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

from lowalt.config.command import pick
from lowalt.config.layers import load_yaml, merge
from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.config.schema import check_brought, of_brought, with_numbers
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.recordings.channel import EDGE, ONE_SIDED_EDGE, SAMPLINGS
from lowalt.spectra import Fourier, Spectra, Transfer

CHANNELS = ("complex", "real")
TWINS = "config/measured/twins.yaml"
TRAINED_RATIO = 1.25
"""Largest ratio of a recording's carrier and the radar's: speeds in a spectrum scale with it."""


@dataclass(frozen=True)
class Twin:
    """A measured radar: `rate_hz` is the rate of its receiver, `symbol_interval_s` the interval of the images' symbols.

    A window holds a target where a line at or above `slowest_mps` (0: targets may hover) stands `detect_db` above the
    recording's noise floor. What is slower than `slowest_mps` is taken out of windows.
    The other fields are named as in a record.
    """

    carrier_hz: float
    channel: str
    rate_hz: float
    symbol_interval_s: float
    symbols: int
    sampling: str
    slowest_mps: float
    detect_db: float

    @classmethod
    def from_settings(cls, block: dict) -> "Twin":
        """Build from a block with exactly the fields' names.

        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        twin = cls(*pick(block, *cls.__dataclass_fields__))
        if twin.channel not in CHANNELS or twin.sampling not in SAMPLINGS:
            raise InputError(f"twin: channel {twin.channel!r}, sampling {twin.sampling!r}, expected one of {CHANNELS} "
                             f"and of {SAMPLINGS}")  # fmt: skip
        twin.network(2)
        return twin

    def at_carrier(self, carrier_hz: float) -> "Twin":
        """Return the twin at a recording's own carrier; the symbol interval stays, so the speeds scale a little."""
        return replace(self, carrier_hz=carrier_hz)

    def near(self, carrier_hz: float) -> bool:
        """Whether a network of this radar may be asked of a recording at a carrier (Hz)."""
        return 1 / TRAINED_RATIO <= carrier_hz / self.carrier_hz <= TRAINED_RATIO

    @property
    def edge_mps(self) -> float:
        """Largest unambiguous radial speed of the symbol rate, lambda / (4 T_r) (m/s)."""
        return SPEED_OF_LIGHT / self.carrier_hz / (4 * self.symbol_interval_s)

    @property
    def fastest_mps(self) -> float:
        """Largest speed that the sampling keeps (m/s): its filter ends there, and a bare line beyond it folds."""
        kept = {"anti_aliased": EDGE, "one_sided": 2 * ONE_SIDED_EDGE, "bare": 1.0}
        return kept[self.sampling] * self.edge_mps

    @property
    def slow(self) -> float:
        """Doppler of `slowest_mps` in cycles a symbol."""
        return self.slowest_mps / (2 * self.edge_mps)

    @property
    def sides(self) -> str:
        """Speeds that the symbol rate shows: "both" signs, "positive", or positive up to twice the edge ("wrapped")."""
        if self.channel == "real" and self.sampling != "bare":
            return "positive" if self.sampling == "anti_aliased" else "wrapped"
        return "both"

    def network_settings(self) -> dict:
        """Return the one-station network of the images as a configuration's block `network`."""
        # With one subcarrier the spacing only sets the length of the one range cell, which nothing depends on.
        return {
            "carrier_hz": self.carrier_hz, "subcarrier_spacing_hz": 1.0, "subcarriers": 1, "guard_subcarriers": 0,
            "symbol_interval_s": self.symbol_interval_s, "symbols": self.symbols, "transmit_array": [1, 1],
            "receive_array": [1, 1], "power_w": 1.0,
            "stations": {"A": {"position_m": [0.0, 0.0, 0.0], "normal_deg": 90.0}},
        }  # fmt: skip

    def network(self, symbols: int, interval_s: float | None = None) -> Network:
        """Return the one-station network of `symbols` at `interval_s` a symbol (by default that of the images)."""
        network = Network.from_settings(self.network_settings() | {"symbols": symbols})
        return network if interval_s is None else replace(network, symbol_interval_s=interval_s)

    def spectra(self) -> Spectra:
        """Return the project's three spectra; the matched speeds cover this radar's unambiguous ones in 123 steps."""
        edge = float(f"{self.edge_mps:.3g}")
        return Spectra(vrp=Fourier(256, 1, 256), trp=Fourier(8, 1, 1024), vt=Transfer(8, 1, -edge, edge, edge / 61))

    def spectra_settings(self) -> dict:
        """Return the spectra as a configuration's block `spectra`."""
        return {name: asdict(settings) for name, settings in self.spectra().items()}


def settings_of(path: str | Path = TWINS) -> dict:
    """Return the configuration of twins in a YAML file.

    A file with the key `base` is merged over the file that it names, key by key; a list replaces the base's list.
    Raises: InputError where it is missing or no mapping.
    """
    block = load_yaml(shipped(path), "twins")
    return merge(load_yaml(shipped(block.pop("base")), "twins"), block) if "base" in block else block


def radars(path: str | Path = TWINS) -> dict[str, Twin]:
    """Return the radars of a configuration of twins by name.

    Raises: InputError naming the key that is missing or wrong.
    """
    try:
        blocks = {str(name): twin["radar"] for name, twin in settings_of(path)["twins"].items()}
    except KeyError as error:
        raise InputError(f"{path}: key {error} is missing") from None
    except (TypeError, AttributeError):
        raise InputError(f"{path}: expected under twins the name of each radar with a block radar") from None
    for name, block in blocks.items():
        check_brought("radar", with_numbers(block, of_brought("radar")), f"{path}: {name}")
    return {name: Twin.from_settings(block) for name, block in blocks.items()}
