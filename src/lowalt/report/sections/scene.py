"""Section: what the run's scene simulates and leaves out, as `lowalt explain` says it."""

import os
from pathlib import Path

from lowalt.common.errors import InputError
from lowalt.effects.explain import scene_facts
from lowalt.effects.explain_text import text
from lowalt.report.run import ReportedRun


def values(run: ReportedRun) -> dict:
    """Return the explanation without times: those of the effects stand in a table of their own."""
    inputs = run.config["inputs"] or os.environ.get("LOWALT_INPUTS")
    try:
        return {"text": text(scene_facts(run.config, inputs and Path(inputs), [], None, False))}
    except InputError as error:
        # Show the page without the explanation where, for example, the recordings have been moved.
        return {"text": f"not explained: {error}"}
