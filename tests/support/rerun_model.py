"""The jobs of a small run, which jobs follow from which, and changes of the run, without a word of
the Snakefile.
"""

from dataclasses import dataclass, field

SEEN = ("dji-mini-2", "crow")
UNSEEN = ("nio-et5t-2023", "walking-pedestrian-5")
OVERLAY = {
    "run": "test",
    "targets": {"select": ["Crow", "NIO ET5T 2023", "DJI Mini 2", "Walking Pedestrian 5"]},
    "motion": {"models": 10, "models_per_chunk": 10},
    "noise": {"snr_db": [8, float("inf")]},
}
# The region is given, so that it does not follow from the stations.
OVERLAY["motion"]["region"] = {
    "polygon_m": [[100, 60], [400, 60], [250, 300]],
    "mast_clearance_m": 10.0,
}
MESH = "meshes/uav/crazyflie_cf2_assembly.stl"

# --- the model: which jobs follow from which ---

PART = "00000"
STATIONS = ("A", "B", "C")
FOLDS = ("train", "val", "test")
GROUPS = {"seen": SEEN, "unseen": UNSEEN}
CHUNKS = [(group, PART) for group in GROUPS]
TRAININGS = [
    (protocol, scheme, "0") for protocol in GROUPS for scheme in ("a-vrp-trp-vt", "abc-vrp-trp-vt")
]
CLOUD = {("cloud", name) for members in GROUPS.values() for name in members}
MOTION = {("motion", *chunk) for chunk in CHUNKS}
ECHO = {("echo", *chunk, station) for chunk in CHUNKS for station in STATIONS}
NOISE = {("noise", *chunk) for chunk in CHUNKS}
TILES = {("tiles", *chunk) for chunk in CHUNKS}
SHARD = {("shard", group, fold, part) for group, part in CHUNKS for fold in FOLDS}
VIEWS = {("views", "24", group, fold, part) for group, part in CHUNKS for fold in FOLDS}
TRAIN = {("train", *training) for training in TRAININGS}
EVALUATE = {("evaluate", *training) for training in TRAININGS}
INDEX = {("index",)}
CARD = {("card",)}
SETTINGS = {("configuration",)}
REPORT = {("report",)}
TABLES = {("tables",)}
GALLERY = {("gallery",)}
FREEZE = {("freeze",)}
DISTANCES = {("distances",)}
MANIFEST = {("report_manifest",)}
WHOLE = {
    *CLOUD,
    *MOTION,
    *ECHO,
    *NOISE,
    *TILES,
    *SHARD,
    *VIEWS,
    *TRAIN,
    *EVALUATE,
    *INDEX,
    *CARD,
    *SETTINGS,
    *REPORT,
    *TABLES,
    *GALLERY,
    *FREEZE,
    *DISTANCES,
    *MANIFEST,
}


def views_of(group, part):
    """The views of a chunk, which come from its tiles and its motion table."""
    return {work for work in VIEWS if (work[2], work[4]) == (group, part)}


def next_jobs(job):
    """Jobs that read a job's products."""
    rule, *names = job
    if rule == "cloud":
        # A subtype that is added belongs to no chunk that was there.
        group = next((group for group, members in GROUPS.items() if names[0] in members), None)
        own = {work for work in MOTION | ECHO if work[1] == group}
        return own | GALLERY | FREEZE | DISTANCES | REPORT
    if rule == "motion":
        own = {work for work in ECHO | NOISE if list(work[1:3]) == names}
        own |= {work for work in SHARD if [work[1], work[3]] == names} | views_of(*names)
        return own | FREEZE | (DISTANCES if names[1] == "00000" else set())
    if rule == "echo":
        return {("noise", *names[:2])}
    if rule in ("noise", "tiles"):
        own = {("shard", names[0], fold, names[1]) for fold in FOLDS}
        return own | ({("tiles", *names)} if rule == "noise" else views_of(*names))
    if rule == "shard":
        return {("views", "24", *names)} | INDEX
    after = {
        "index": CARD | REPORT,
        "views": TRAIN | EVALUATE,
        "freeze": TRAIN | EVALUATE,
        "train": {("evaluate", *names)},
        "evaluate": TABLES,
        "tables": REPORT,
        "gallery": set(),
        "distances": REPORT,
        "configuration": CARD | REPORT,
        "report_manifest": REPORT,
        "card": set(),
        "report": set(),
    }
    return after[rule]


def with_what_follows(jobs, images=True):
    """The jobs, all that follow from them, and the temporary tiles that shards are packed from."""
    found = set()
    todo = list(jobs)
    while todo:
        job = todo.pop()
        if job not in found:
            found.add(job)
            todo += next_jobs(job)
    if not images:
        return found - TILES
    return found | {("tiles", job[1], job[3]) for job in found if job[0] == "shard"}


def grown(part):
    """The jobs of one more chunk of each group, and those that read all chunks."""
    own = {(rule, group, part) for group in GROUPS for rule in ("motion", "noise", "tiles")}
    own |= {("echo", group, part, station) for group in GROUPS for station in STATIONS}
    own |= {
        (*work, group, fold, part)
        for work in (("shard",), ("views", "24"))
        for group in GROUPS
        for fold in FOLDS
    }
    return own | INDEX | CARD | FREEZE | TRAIN | EVALUATE | TABLES | REPORT | MANIFEST | SETTINGS


def added(part, groups, motion):
    """The jobs of added chunks, with motion models of their own or without, and those that read all
    samples.
    """
    rules = ("motion", "noise", "tiles") if motion else ("noise", "tiles")
    own = {(rule, group, PART + part) for rule in rules for group in groups}
    chunks = [(group, PART + part) for group in groups]
    if motion:
        own |= (
            {("echo", *chunk, station) for chunk in chunks for station in STATIONS}
            | FREEZE
            | DISTANCES
            | GALLERY
        )
    for group, number in chunks:
        own |= {
            (*work, group, fold, number) for work in (("shard",), ("views", "24")) for fold in FOLDS
        }
    return own | INDEX | CARD | TRAIN | EVALUATE | TABLES | REPORT | MANIFEST | SETTINGS


# --- the changes ---


@dataclass
class Change:
    """One change of a finished run: an overlay, or a text replaced in a file; the jobs it touches;
    the reason named.
    """

    first: set
    reasons: tuple[str, ...] = ("Params have changed",)
    overlay: dict = field(default_factory=dict)
    edit: tuple[str, str, str] | None = None
    expected: set | None = None

    @property
    def jobs(self):
        """The jobs that the change makes run again."""
        settings = SETTINGS if self.overlay else set()
        return with_what_follows(self.first | settings) if self.expected is None else self.expected


def code(path, first):
    """A comment at the end of a source file."""
    return Change(first, (f"src/lowalt/{path}",), edit=(f"src/lowalt/{path}", "", "\n# edited\n"))
