"""Whether the region, the matched speeds and the schemes of a configuration suit its stations and their signal.

Each function raises InputError that names key, value and what was expected. `Run.of` calls them before any job starts.
"""

from lowalt.common.errors import InputError
from lowalt.common.files import slug
from lowalt.common.network import SPEED_OF_LIGHT, masts_m, station_names
from lowalt.recognition.schemes import Scheme, columns_in, named, names
from lowalt.spectra.catalogue import named as spectra_named


def refuse_region(config: dict) -> None:
    """Refuse a region without an area, be it given or that between the stations."""
    given = config["motion"]["region"]["polygon_m"]
    corners = masts_m(config["network"]) if given is None else given
    sides = [(x - corners[0][0], y - corners[0][1]) for x, y in corners[1:]]
    if all(a * d == b * c for a, b in sides for c, d in sides):
        stations = f", the area between the stations, and there is none between {corners}" if given is None else ""
        raise InputError(
            f"motion.region.polygon_m: {given}{stations}; expected corners (m) such as [[0, 0], [500, 0], [250, 433]]"
        )


def refuse_speeds(config: dict) -> None:
    """Refuse matched speeds of the VT spectrum that repeat themselves: beyond c / (4 f T_r) speeds fold."""
    network, vt = config["network"], config["spectra"].get("vt")
    fold = SPEED_OF_LIGHT / (4 * network["carrier_hz"] * network["symbol_interval_s"])
    # Symbols at uneven instants tell speeds beyond it apart, where their instants are known.
    if vt is None or config["spectra"].get("times") == "known":
        return
    low, high = vt["speed_min_mps"], vt["speed_max_mps"]
    if high - low > 2 * fold + vt["speed_step_mps"]:
        raise InputError(
            f"spectra.vt: speed_min_mps {low:g} to speed_max_mps {high:g}, expected at most {-fold:.3g} to {fold:.3g}: "
            f"speeds fold there with network.carrier_hz {network['carrier_hz']:g} and symbol_interval_s "
            f"{network['symbol_interval_s']:g}"
        )


def _suited(config: dict, name: str) -> Scheme:
    """The scheme of the table, whose stations and spectra this configuration has."""
    table, stations = config["recognition"]["table"], station_names(config["network"])
    scheme = named(table, name, stations)
    columns_in(scheme.columns, spectra_named(config["spectra"]), len(stations), table)
    return scheme


def _able(config: dict) -> list[str]:
    """Names of the table's schemes whose stations and spectra this configuration has."""
    found = []
    for name in names(config["recognition"]["table"]):
        try:
            found.append(_suited(config, name).name)
        except InputError:
            continue
    return found


def schemes_of(config: dict) -> dict[str, Scheme]:
    """Return the schemes that a run trains or times, by the name that the configuration gives them.

    Raises: InputError for a scheme that stations and spectra do not suit, with those that they suit; for one named
    twice; and where none trains in a protocol of the run.
    """
    block = config["recognition"]
    known, found = set(map(slug, names(block["table"]))), {}
    for key in ("schemes", "timed"):
        for name in block[key]:
            try:
                found[name] = _suited(config, name)
            except InputError as error:
                able = _able(config) or "none: name a table of your own in recognition.table"
                rest = f"; for this network and its spectra {block['table']} has {able}" * (slug(name) in known)
                raise InputError(f"recognition.{key}: {name!r}: {error}{rest}") from None
    trained = [found[name] for name in block["schemes"]]
    if len({scheme.name for scheme in trained}) < len(trained):
        raise InputError(f"recognition.schemes: {block['schemes']}, expected every scheme once")
    if not any(set(scheme.protocols) & set(block["protocols"]) for scheme in trained):
        raise InputError(
            f"recognition.protocols: {block['protocols']}, expected a protocol of one of {block['schemes']}, which "
            f"{block['table']} gives {sorted({name for scheme in trained for name in scheme.protocols})}"
        )
    return found
