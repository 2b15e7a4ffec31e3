"""Choices of the paper that no key of the configuration expresses, for this study alone.

A row of `choices.yaml` names them under `local`:
    cell       range cell of each symbol, where the paper takes the strongest one of each:
               look    the strongest of the look, after summing power over symbols
               first   the strongest of the first symbol, for the whole look
               centre  the cell of the target's middle at each symbol
               smooth  the strongest of each symbol, its phase counted as if subcarriers lay evenly
               about the carrier
    rotors     aligned  every rotor starts as its cloud stands
               step     all rotors of a craft start at one random angle
               alike    all rotors turn in one sense
               rates    each rotor has a rate of its own, drawn from the published range
    course     nose     craft and birds move along their front, as fast as drawn
    parts      strong   rotors, wings and wheels reflect ten times as much power a point as bodies
    size       published craft and birds are scaled until their longest side is the published size
    amplitude  equal    every point's echo is as strong at any range
"""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np

from lowalt.config.classes import AIRBORNE
from lowalt.config.network import Network, Station
from lowalt.echo import Rigid
from lowalt.echo.api import echo_signal
from lowalt.motion.poses import Perturbation, poses
from lowalt.motion.rotations import attitude
from lowalt.numerics.streams import stream
from lowalt.scene.chain import SceneSample
from lowalt.scene.effects import NamedEffect
from lowalt.scene.observe import Scene, observe
from lowalt.targets.cloud import Cloud, extent, scaled

CELLS = ("look", "first", "centre")


def changed_row(row: dict, cloud: Cloud, local: dict) -> dict:
    """Return a motion table's row under the local choices."""
    row = dict(row)
    phases = [f"phase_{order}_rad" for order in range(len(cloud.parts_of("rotor")))]
    if local.get("rotors") == "aligned":
        row.update(dict.fromkeys(phases, 0.0))
    if local.get("rotors") == "step":
        row.update({name: row[phases[0]] for name in phases})
    if local.get("course") == "nose" and cloud.like in AIRBORNE:
        speed = np.linalg.norm([row[f"v{axis}_mps"] for axis in "xyz"])
        front = attitude(row["yaw_rad"], row["pitch_rad"], row["roll_rad"])[:, 1]
        row.update(
            {f"v{axis}_mps": float(speed * part) for axis, part in zip("xyz", front, strict=True)}
        )
    return row


def changed_cloud(cloud: Cloud, local: dict, published: dict) -> Cloud:
    """Return a target under the local choices; published: its row of the table of targets."""
    if local.get("rotors") == "alike":
        axes = cloud.axes.copy()
        rotors = cloud.parts_of("rotor")
        axes[rotors] = abs(axes[rotors])
        cloud = replace(cloud, axes=axes)
    if local.get("parts") == "strong":
        moving = [part for kind in ("rotor", "wing", "wheel") for part in cloud.parts_of(kind)]
        cloud = replace(
            cloud, rcs_m2=np.where(np.isin(cloud.part, moving), 10.0, 1.0) * cloud.rcs_m2
        )
    if local.get("size") == "published" and cloud.like in AIRBORNE:
        cloud = scaled(cloud, published["size_m"] / extent(cloud))
    return cloud


def own_rates(
    published: dict, seed: int, cloud: Cloud, row: dict, times_s: np.ndarray, _
) -> Perturbation:
    """Return the turns (rad) that bring each rotor to a rate of its own from the published range of
    the subtype.
    """
    rotors = cloud.parts_of("rotor")
    low = published["freq_lo_hz"]
    high = published["freq_hi_hz"]
    if not rotors:
        return Perturbation({})
    own = stream(seed, "open-choices-rates", row["subtype"], row["model"]).uniform(
        low, high, len(rotors)
    )
    return Perturbation(
        {
            part: 2 * np.pi * (rate - row["rate_hz"]) * times_s
            for part, rate in zip(rotors, own, strict=True)
        }
    )


def local_effects(local: dict, published: dict, seed: int) -> tuple[NamedEffect, ...]:
    """Return the local choices that act in the scene's chain; published: the subtype's row of the
    table of targets.
    """
    found = []
    if local.get("rotors") == "rates":
        perturb = partial(own_rates, published, seed)
        module = SimpleNamespace(perturb=lambda _, *asked: perturb(*asked))
        found.append(NamedEffect("own_rates", "motion", module, {}))
    if local.get("amplitude") == "equal":
        # 1 at 250 m, in the middle of the cell; SNRs are relative.
        module = SimpleNamespace(visible=lambda _, view, rng: (view.ways_m(view.places) / 500) ** 2)
        found.append(NamedEffect("equal_amplitudes", "channel", module, {}))
    return tuple(found)


def signals_by_cell(sample: SceneSample) -> dict[str, np.ndarray]:
    """Return the signal (N,) of a sample under each choice of the range cell in CELLS."""
    cells = sample.cells
    power = abs(cells) ** 2
    centre = sample.true_cell(sample.view)
    return {
        "look": cells[:, power.sum(axis=0).argmax()],
        "first": cells[:, power[0].argmax()],
        "centre": cells[np.arange(len(cells)), centre],
    }


def continuous(network: Network, station: Station, cloud: Cloud, row: dict) -> np.ndarray:
    """Return the signal (N,) of the strongest cell of each symbol without the phase that a cell's
    number brings.

    With subcarriers from -M/2 to M/2 the phase does not turn by pi (M - 1) / M from one cell to the
    next.
    """
    motion = Rigid(*poses(cloud, row, network.times_s), cloud.points, cloud.part)
    echo = echo_signal(
        network, station, motion, cloud.rcs_m2, np.array([row[f"{axis}_m"] for axis in "xyz"])
    )
    return echo.signal * np.exp(
        -1j * np.pi * (network.subcarriers - 1) / network.subcarriers * echo.cell
    )


def sample_of(scene: Scene, name: str, cloud: Cloud, row: dict) -> SceneSample:
    """Return a sample at the station `name` of a scene."""
    return SceneSample(scene, observe(scene, scene.network.station(name), cloud, row))
