"""Electrical properties of building materials and soils by name."""

from typing import NamedTuple

from lowalt.files.errors import InputError, instead


class Law(NamedTuple):
    """Relative permittivity a f^b and conductivity c f^d (S/m), f in GHz from `low` to `high`."""

    a: float
    b: float
    c: float
    d: float
    low: float
    high: float


MATERIALS = {
    "concrete": Law(5.24, 0.0, 0.0462, 0.7822, 1.0, 100.0),
    "brick": Law(3.91, 0.0, 0.0238, 0.16, 1.0, 40.0),
    "plasterboard": Law(2.73, 0.0, 0.0085, 0.9395, 1.0, 100.0),
    "wood": Law(1.99, 0.0, 0.0047, 1.0718, 0.001, 100.0),
    "glass": Law(6.31, 0.0, 0.0036, 1.3394, 0.1, 100.0),
    "ceiling_board": Law(1.48, 0.0, 0.0011, 1.075, 1.0, 100.0),
    "chipboard": Law(2.58, 0.0, 0.0217, 0.78, 1.0, 100.0),
    "plywood": Law(2.71, 0.0, 0.33, 0.0, 1.0, 40.0),
    "marble": Law(7.074, 0.0, 0.0055, 0.9262, 1.0, 60.0),
    "floorboard": Law(3.66, 0.0, 0.0044, 1.3515, 50.0, 100.0),
    "metal": Law(1.0, 0.0, 1e7, 0.0, 1.0, 100.0),
    "very_dry_ground": Law(3.0, 0.0, 0.00015, 2.52, 1.0, 10.0),
    "medium_dry_ground": Law(15.0, -0.1, 0.035, 1.63, 1.0, 10.0),
    "wet_ground": Law(30.0, -0.4, 0.15, 1.3, 1.0, 10.0),
}
"""Materials by the names of ITU-R P.2040-3, Table 3, with underscores."""


def named(text: str) -> str | None:
    """Return the material that a name means, None for none that is known.

    Such names are `mat-itu_concrete` or `Brick.001`.
    """
    plain = text.lower().replace("-", "_").replace(" ", "_")
    held = [name for name in MATERIALS if name in plain]
    return max(held, key=len, default=None)


def properties(name: str, frequency_hz: float, where: str) -> tuple[float, float]:
    """Return relative permittivity and conductivity (S/m) of a material at a frequency.

    where: the key or file that names the material, for the message. Source: ITU-R P.2040-3, section
    3 and Table 3.
    Raises: InputError for an unknown name, or a frequency at which the material's properties are
    not known.
    """
    if name not in MATERIALS:
        raise InputError(f"{where}: material {name!r}, expected {instead([name], MATERIALS)}")
    law = MATERIALS[name]
    ghz = frequency_hz / 1e9
    if not law.low <= ghz <= law.high:
        raise InputError(
            f"{where}: {name} is known from {law.low:g} to {law.high:g} GHz, the carrier is "
            f"{ghz:.3g} GHz; expected another material"
        )
    return law.a * ghz**law.b, law.c * ghz**law.d
