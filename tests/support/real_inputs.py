"""Where the real meshes and recordings are, for the tests that need them: LOWALT_INPUTS or
../shared/data.
"""

import os
from pathlib import Path

import pytest

FOLDER = Path(os.environ.get("LOWALT_INPUTS") or Path(__file__).parents[3] / "shared" / "data")

needs_inputs = pytest.mark.skipif(
    not (FOLDER / "cmu").is_dir() or not (FOLDER / "meshes").is_dir(),
    reason=(
        f"no real inputs: {FOLDER} lacks cmu/ and meshes/ (set LOWALT_INPUTS to the folder that has"
        " them)"
    ),
)
