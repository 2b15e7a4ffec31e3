# Common to all rules: the run derived from the configuration, and the functions used in rules.
# RUN: names, plan and schemes; given: options for inputs that only some jobs have; code: the
# source files of a command.
# Each rule file begins with the module of its stage, which holds what its rules take besides paths.
from functools import partial
from pathlib import Path

from lowalt.config.command import UserErrorsInOneLine, user_errors_in_one_line
from lowalt.machine.environment import prepare
from lowalt.shards.plan import PART, PIECE
from lowalt.scene.effects import dotted
from lowalt.workflow import mends, space
from lowalt.files.shipped import located
from lowalt.workflow.run import Run
from lowalt.workflow.stages.stage import given
from lowalt.workflow.sources import ROOT, code as code_of

mends.install()
SCHEMA = workflow.source_path("../schemas/config.schema.yaml")
config.update(located(config))
with user_errors_in_one_line():
    RUN = Run.of(config, SCHEMA, prepare(ROOT, config["inputs"]))
    space.writable(Path.cwd(), RUN.name)

code = partial(code_of, spectra=tuple(name for name in config["spectra"] if name != "times"))

# The run whose data set is used for training: RUN, unless the configuration names another.
DATA = f"results/{RUN.data}"
# Images of this run's own samples, shrunk to the sizes of the schemes that are trained.
OWN_VIEWS = expand(
    "results/{run}/views/{size}/{shard}.npz",
    run=RUN.name,
    size=RUN.image_sizes,
    shard=RUN.plan.shards,
)
# An echo job computes the signals of one station or of all stations.
LISTENING = ["{station}"] if RUN.echo_per_station else RUN.stations
OF_STATION = "-{station}" if RUN.echo_per_station else ""


wildcard_constraints:
    run=RUN.name,
    subtype="|".join(RUN.subtypes),
    group="|".join(RUN.plan.groups),
    part=PART,
    piece=PIECE,
    station="|".join(RUN.stations),
    fold="train|val|test",
    protocol="seen|unseen",
    scheme="|".join(RUN.schemes_by_slug),
    # Matches nothing if the configuration names no other runs.
    other="|".join(config["recognition"]["transfer"]) or "(?!)",
    size=r"\d+",
    call=r"[a-z0-9_-]+",
    train_seed=r"\d+",
