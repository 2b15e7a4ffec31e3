"""Section: whether the receiver of the run's scene finds its targets, as `lowalt explain` says."""

import os
from pathlib import Path

from lowalt.files.errors import InputError
from lowalt.report.reported_run import ReportedRun


def values(run: ReportedRun) -> dict:
    """Return the verdict on a scene with effects; without effects every target is found."""
    if not run.config["effects"]:
        return {"lines": []}
    # The effects' modules are loaded only for runs that have some.
    from lowalt.scene import explanation

    inputs = run.config["inputs"] or os.environ.get("LOWALT_INPUTS")
    try:
        scene = explanation.scene_of(run.config)
        chosen = explanation.samples(run.config, Path(inputs) if inputs else None, [])
    except InputError as error:
        # Show the page without the verdict where, for example, the recordings have been moved.
        return {"lines": [f"not explained: {error}"]}
    clouds = {sample.cloud.subtype: sample.cloud for sample in chosen}
    findings = []
    for sample in chosen:
        for end in scene.network.stations:
            findings.append(explanation.finding(scene, end, sample, clouds))
    return {"lines": explanation.verdict(findings)}
