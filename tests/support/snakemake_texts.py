"""Texts for tests of the real workflow: a spy on imports, another workflow's rules, and the code that rules declare."""

import re
from pathlib import Path

from lowalt.workflow.sources import PACKAGE, sources

ROOT = Path(__file__).parents[2]
# Python imports this by itself at start: every job notes its command and the package's modules it ended up with, and a
# job that asks for the network ends.
SPY = """
import atexit, os, pathlib, sys, uuid

def note():
    files = {getattr(module, "__file__", None) or "" for module in list(sys.modules.values())}
    base = os.environ["LOWALT_TEST_PACKAGE"]
    files = sorted(os.path.relpath(file, base) for file in files if file.startswith(base))
    if files and sys.argv[0].startswith(base):
        command = os.path.relpath(sys.argv[0], base), sys.argv[1]
        lines = "\\n".join([" ".join(command), *files])
        pathlib.Path(os.environ["LOWALT_TEST_IMPORTS"], uuid.uuid4().hex).write_text(lines)

if "LOWALT_TEST_IMPORTS" in os.environ:
    atexit.register(note)

    def refuse(event, arguments):
        if event == "socket.getaddrinfo" or event == "socket.connect" and not isinstance(arguments[1], (str, bytes)):
            raise RuntimeError(f"a job asked for the network: {event} {arguments[1:]}")

    sys.addaudithook(refuse)
"""
RULES = {
    "targets/__main__.py": "cloud", "targets/gallery.py": "gallery", "motion/__main__.py": "motion",
    "echo/__main__.py": "echo", "noise/__main__.py": "noise", "tiles/__main__.py": "tiles",
    "shards/__main__.py write": "shard", "shards/__main__.py index": "index", "shards/card.py": "card",
}  # fmt: skip
MODULE = """
configfile: "{root}/config/default.yaml"
configfile: "{root}/overlay.yaml"

module lowalt:
    snakefile: "{root}/Snakefile"
    config: config

use rule * from lowalt as lowalt_*

rule size:
    default_target: True
    input: "results/test/motion/unseen-00000.csv"
    output: "size.txt"
    shell: "wc -c < {{input}} > {{output}}"
"""
"""A Snakefile that uses this workflow as a module; root: the folder of the project."""


def body(rule: str) -> str:
    """The text of a rule in its rule file."""
    text = "\n".join(path.read_text() for path in sorted((ROOT / "workflow/rules").glob("*.smk")))
    return re.search(rf"^rule {rule}:\n(.*?)(?=^rule |\Z)", text, re.MULTILINE | re.DOTALL)[1]


def declared(rule: str) -> set[str]:
    """The source files a rule declares as its code, relative to the package, from the arguments in its rule file."""
    arguments = re.search(r"code=code\((.*?)\)", body(rule), re.DOTALL)[1]
    modules = re.findall(r'"([\w.]+)"', arguments)
    if "SOURCE_MODULES" in arguments:
        modules += [f"lowalt.targets.{name}" for name in ("builtin", "gait", "mesh", "mocap")]
    return {str(path.relative_to(PACKAGE)) for path in sources(*modules, spectra=("vrp", "trp", "vt"))}
