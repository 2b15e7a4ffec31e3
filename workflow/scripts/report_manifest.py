"""Write the report's manifest: the names of its files, as the parameter of the rule gives them."""

import json
from pathlib import Path

# Snakemake puts the object `snakemake` into the script before its first line.
job = snakemake  # noqa: F821
Path(job.output[0]).write_text(json.dumps(job.params.files, indent=1) + "\n")
