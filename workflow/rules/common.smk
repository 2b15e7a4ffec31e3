# Common to all rules: the run derived from the configuration, and the functions used in rules.
# RUN: names, plan and schemes; products: the files a rule reads; settings: what a stage reads of the configuration;
# options: command-line options that only some jobs have; code: the source files of a command.
from functools import partial
from pathlib import Path

from lowalt.config.command import Refusing, refusing
from lowalt.machine.environment import prepare
from lowalt.config.plan import PART, PIECE
from lowalt.scene.effects import dotted
from lowalt.workflow import mends, options, space
from lowalt.files.shipped import located, shipped
from lowalt.workflow.products import PRESETS, TABLES, Products
from lowalt.workflow.run import Run
from lowalt.workflow.stage_settings import Settings
from lowalt.workflow.sources import ROOT, code as code_of

mends.install()
SCHEMA = workflow.source_path("../schemas/config.schema.yaml")
config.update(located(config))
with refusing():
    RUN = Run.of(config, SCHEMA, prepare(ROOT, config["inputs"]))
    space.writable(Path.cwd(), RUN.name)

products = Refusing(Products(RUN))
settings = Refusing(Settings(RUN))
code = partial(code_of, spectra=tuple(name for name in config["spectra"] if name != "times"))

# The run whose data set is used for training: RUN, unless the configuration names another.
DATA = f"results/{RUN.data}"
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
