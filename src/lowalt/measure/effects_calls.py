"""The calls for effects that are measured, from a run's configuration: none, every effect alone, scenes."""

from pathlib import Path

from lowalt.common.config import check, merge
from lowalt.common.errors import InputError
from lowalt.common.yaml_files import load_yaml
from lowalt.scene.catalogue import PLACES
from lowalt.scene.checks import check as check_effects

ELSEWHERE = ("network", "targets", "motion", "spectra", "images", "split", "seed")
"""Blocks that a scene may not change here: its samples would no longer be those of the run."""


def asked_snrs(snrs: list[float]) -> list[float]:
    """Return the SNRs (dB) at which the network is asked: the lower middle one of a run's, and no noise."""
    return list(dict.fromkeys([sorted(snrs)[(len(snrs) - 1) // 2], float("inf")]))


def calls(config: dict, schema: str | Path) -> dict[str, dict]:
    """Return {effects, tolerance, snr_db} of every call by its name, in the chain's order, scenes last.

    config: the checked configuration; its report.effect_scenes name the scenes, by file. An effect alone has its
    defaults. A call with a link budget (receiver_noise) gets no noise at set SNRs.
    Raises: InputError where the run has effects itself, or a scene is refused, changes the run's samples or has a
    name that is taken.
    """
    if config["effects"]:
        raise InputError(
            f"effects: {sorted(config['effects'])}, expected none: a network trained without them shows what they do"
        )
    tolerance = config["echo"]["tolerance"]
    blocks = {"none": ({}, tolerance), **{name: ({name: {}}, tolerance) for name in PLACES}}
    for path in config["report"]["effect_scenes"]:
        scene, name = load_yaml(path), Path(path).stem
        moved = [key for key in ELSEWHERE if key in scene]
        if name in blocks:
            raise InputError(f"report.effect_scenes: {path}: the name {name!r} is taken, expected another")
        if moved:
            raise InputError(f"report.effect_scenes: {path} changes {moved}, expected only effects, echo and noise")
        merged = check(merge(config, scene), schema)
        check_effects(merged)
        blocks[name] = (merged["effects"], merged["echo"]["tolerance"])
    asked = asked_snrs([float(snr) for snr in config["noise"]["snr_db"]])
    return {
        name: {
            "effects": effects,
            "tolerance": allowed,
            "snr_db": [float("inf")] if "receiver_noise" in effects else asked,
        }
        for name, (effects, allowed) in blocks.items()
    }
