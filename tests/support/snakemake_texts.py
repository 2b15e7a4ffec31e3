"""Texts for tests of the real workflow: a spy on imports, another workflow's rules, and the code
that rules declare.
"""

import re
from pathlib import Path

from lowalt.workflow.sources import PACKAGE, sources

ROOT = Path(__file__).parents[2]
# Python imports this by itself at start: every job notes its command and the package's modules it
# ended up with, the files that it opened, and the keys of its settings that it asked for; a job
# that asks for the network ends.
SPY = """
import atexit, json, os, pathlib, sys, uuid

opened, absent = set(), set()

class Asked(dict):
    # A block of settings that notes the keys that are asked for and are not there.
    def __contains__(self, key):
        found = super().__contains__(key)
        if not found:
            absent.add(key)
        return found

    def get(self, key, default=None):
        return self[key] if key in self else default

    def pop(self, key, *default):
        key in self
        return super().pop(key, *default)

if "--settings" in sys.orig_argv and not {"lowalt.config.layers", "lowalt.report", "train"} & {*sys.orig_argv}:
    # These write their settings to files as they are.
    settings, loads = sys.orig_argv[sys.orig_argv.index("--settings") + 1], json.loads
    json.loads = lambda text, **how: loads(text, **how | ({"object_pairs_hook": Asked} if text == settings else {}))

def note():
    log = pathlib.Path(os.environ["LOWALT_TEST_IMPORTS"]).parent / "opened"
    log.mkdir(exist_ok=True)
    try:
        mine = {"log": os.path.relpath(os.readlink("/proc/self/fd/2")), "opened": sorted(opened),
                "absent": sorted(map(str, absent))}
    except (OSError, ValueError):
        return
    if mine["log"].startswith("results"):
        (log / uuid.uuid4().hex).write_text(json.dumps(mine))

def note_imports():
    files = {getattr(module, "__file__", None) or "" for module in list(sys.modules.values())}
    base = os.environ["LOWALT_TEST_PACKAGE"]
    files = sorted(os.path.relpath(file, base) for file in files if file.startswith(base))
    if files and sys.argv[0].startswith(base):
        command = os.path.relpath(sys.argv[0], base), sys.argv[1]
        lines = "\\n".join([" ".join(command), *files])
        pathlib.Path(os.environ["LOWALT_TEST_IMPORTS"], uuid.uuid4().hex).write_text(lines)

if "LOWALT_TEST_IMPORTS" in os.environ:
    atexit.register(note_imports)
    atexit.register(note)

    def refuse(event, arguments):
        if event == "open" and isinstance(arguments[0], (str, bytes, os.PathLike)) and not arguments[2] & 3:
            opened.add(os.path.relpath(os.path.abspath(os.fsdecode(arguments[0]))))
        if event == "socket.getaddrinfo" or event == "socket.connect" and not isinstance(arguments[1], (str, bytes)):
            raise RuntimeError(f"a job asked for the network: {event} {arguments[1:]}")

    sys.addaudithook(refuse)
"""
RULES = {
    "targets/__main__.py": "cloud",
    "targets/gallery.py": "gallery",
    "motion/__main__.py": "motion",
    "echo/__main__.py": "echo",
    "noise/__main__.py": "noise",
    "tiles/__main__.py": "tiles",
    "shards/__main__.py write": "shard",
    "shards/__main__.py index": "index",
    "shards/card.py": "card",
}
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
    """The source files a rule declares as its code, relative to the package, from the arguments in
    its rule file.
    """
    arguments = re.search(r"code=code\((.*?)\)", body(rule), re.DOTALL)[1]
    modules = re.findall(r'"([\w.]+)"', arguments)
    return {
        str(path.relative_to(PACKAGE)) for path in sources(*modules, spectra=("vrp", "trp", "vt"))
    }
