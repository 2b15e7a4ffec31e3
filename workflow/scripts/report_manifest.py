"""Write the report's manifest: the names of its files, as the parameter of the rule gives them."""

import json
from pathlib import Path

from snakemake.script import snakemake

Path(snakemake.output[0]).write_text(json.dumps(snakemake.params.files, indent=1) + "\n")
