"""The documents keep their word: functions, files, keys and commands that they name exist, and the
site links them.
"""

import argparse
import functools
import html
import importlib
import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
import yaml
from key_pages import configuration_page, effects_page

from lowalt.__main__ import main
from lowalt.config.layers import load, overlaid
from lowalt.files.errors import InputError, install_command
from lowalt.scene.effects import PLACES
from pages import browsed

ROOT = Path(__file__).parent.parent
PAGES = sorted([ROOT / "README.md", *ROOT.glob("docs/**/*.md")])
OTHERS = [
    ROOT / "CONTRIBUTING.md",
    ROOT / "SECURITY.md",
    *(ROOT / "design").glob("*.md"),
    *ROOT.glob("*/README.md"),
]
PHYSICS = (ROOT / "docs/physics.md").read_text()
SORTS = (
    r"\.venv/bin/(?:lowalt|python|snakemake|pip)\b[^`\n]+",
    r"(?<=`)make -C [\w/-]+ [a-z-]+",
    r"(?<=`)make [a-z][a-z-]*",
    r"(?<=`)python -m lowalt\.[^`\n]*",
)
COMMAND = re.compile("|".join([*SORTS, r"^python -m lowalt\.[^`\n]*"]), re.MULTILINE)


def commands(page: Path) -> list[str]:
    """Commands of a page: in code spans, and lines of shell blocks."""
    return [
        line.partition("  #")[0].strip()
        for line in COMMAND.findall(page.read_text().replace("\\\n", " "))
    ]


# `tests/config/test_strangers_package.py` runs these, where the tutorial's package is installed.
OF_A_STRANGER = r"-m pip install .*\./mist|lowalt mist"
NAMED = [
    (page.relative_to(ROOT).as_posix(), command)
    for page in [*PAGES, *OTHERS]
    for command in commands(page)
    if not re.search(OF_A_STRANGER, command)
]


class Parsed(Exception):
    """Raised in the place of running a command whose line was understood."""


@pytest.fixture
def only_parsed(monkeypatch):
    """`main` understands its line and stops."""
    whole = argparse.ArgumentParser.parse_args

    def stop(self, *given):
        whole(self, *given)
        raise Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", stop)


def test_there_are_commands_of_every_sort():
    words = {command.split()[0] for _, command in NAMED} - {"python"}
    assert words == {
        ".venv/bin/lowalt",
        ".venv/bin/python",
        ".venv/bin/snakemake",
        ".venv/bin/pip",
        "make",
    }
    assert len(NAMED) > 60


@pytest.mark.parametrize(
    "page, command", [pair for pair in NAMED if pair[1].startswith(".venv/bin/lowalt")]
)
def test_every_command_of_lowalt_is_understood(page, command, only_parsed):
    # FILE, NAME and the like stand for any value; KEY and N are such words too.
    with pytest.raises((Parsed, SystemExit)) as ended:
        main(shlex.split(command)[1:])
    if ended.type is SystemExit:
        assert "--help" in command and ended.value.code == 0, f"{page}: {command}"


@pytest.mark.parametrize("page, command", [pair for pair in NAMED if "python -m" in pair[1]])
def test_every_module_and_its_options_exist(page, command):
    words = shlex.split(command)[2:]
    if words[0] in ("pytest", "pip_audit") or "STAGE" in command:
        return
    path = ROOT / "src" / words[0].replace(".", "/")
    source = path.with_suffix(".py") if path.with_suffix(".py").is_file() else path / "__main__.py"
    assert source.is_file(), f"{page}: {command}"
    # A command may take its options from functions of its room, or of the rooms that know no stage.
    ground = [
        file for room in ("files", "config") for file in (ROOT / "src/lowalt" / room).glob("*.py")
    ]
    rooms = (source, *source.parent.glob("*.py"), *ground)
    known = "\n".join(file.read_text() for file in rooms)
    missing = [
        word
        for word in words
        if word.startswith("--") and word != "--help" and f'"{word}"' not in known
    ]
    assert not missing, f"{page}: {command}"


def test_snakemake_understands_every_command_and_has_its_rules():
    from snakemake.cli import get_argument_parser

    read = get_argument_parser()
    wanted = set()
    for words in (
        shlex.split(command)[1:]
        for _, command in NAMED
        if command.startswith(".venv/bin/snakemake")
    ):
        asked = read.parse_args(words)
        wanted |= {name for name in [*asked.targets, *(asked.forcerun or ())] if "/" not in name}
    rules = "".join(
        path.read_text() for path in [ROOT / "Snakefile", *(ROOT / "workflow/rules").glob("*.smk")]
    )
    assert len(wanted) >= 4 and not wanted - set(re.findall(r"^ *rule (\w+):", rules, re.MULTILINE))


@pytest.mark.parametrize(
    "page, command",
    [pair for pair in NAMED if re.match(r"\.venv/bin/python (?!-m lowalt|-m pip_audit)", pair[1])],
)
def test_every_program_and_its_options_exist(page, command):
    words = shlex.split(command)[1:]
    files = [ROOT / word for word in words if re.fullmatch(r"[\w./-]+\.py", word)]
    made = re.findall(r'title="([^"]+)"', (ROOT / page).read_text())
    assert files and all(file.is_file() or file.name in made for file in files)
    if words[0] != "-m":
        known = files[0].read_text() if files[0].is_file() else ""
        assert not [word for word in words if word.startswith("--") and f'"{word}"' not in known]


def test_every_extra_that_a_command_installs_exists():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    named = [
        name
        for _, command in NAMED
        for some in re.findall(r"-e '\.\[(.+)\]'", command)
        for name in some.split(",")
    ]
    assert len(named) > 3 and not set(named) - set(extras)


def test_a_missing_package_is_asked_for_by_its_own_name():
    """No index holds this package, so a stranger could publish one of its name."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    for extra, packages in extras.items():
        start = "pip install "
        said = install_command(extra)
        assert said.startswith(start)
        # The metadata writes the bounds of versions in an order of its own.
        asked = {
            frozenset(re.findall(r"[\w.-]+(?:\[\w+\])?", package))
            for package in shlex.split(said)[2:]
        }
        assert asked == {
            frozenset(re.findall(r"[\w.-]+(?:\[\w+\])?", package)) for package in packages
        }
    texts = [
        *ROOT.glob("src/**/*.py"),
        *ROOT.glob("src/**/*.jinja"),
        *ROOT.glob("workflow/**/*"),
        *PAGES,
        *OTHERS,
    ]
    from_index = []
    for path in texts:
        for line in path.read_text().splitlines() if path.is_file() else ():
            if re.search(r"pip install (?!.*--no-index)[^`]*\blowalt\b", line):
                from_index.append(f"{path}: {line}")
    assert not from_index


@functools.cache
def packages_of_modules():
    """The packages that offer each module, read from every installed package's files."""
    return metadata.packages_distributions()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_that_imports_a_package_beyond_the_set_up_says_how_to_install_it(page):
    """Also where only the program in `examples/` imports it that a command of the page runs."""
    text = page.read_text()
    programs = set(re.findall(r"\.venv/bin/python (examples/\w+\.py)", text))
    code = "\n".join(
        [
            *re.findall(r"^```python.*?\n(.*?)^```$", text, re.DOTALL | re.MULTILINE),
            *((ROOT / name).read_text() for name in programs),
        ]
    )
    modules = set(re.findall(r"^\s*(?:import|from) (\w+)", code, re.MULTILINE))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    known = [
        *project["dependencies"],
        *(need for name in ("workflow", "cost", "recognition") for need in extras[name]),
    ]
    named = ",".join(re.findall(r"pip install[^`\n]*'\.\[([\w,]+)\]'", text))
    known += [need for name in filter(None, named.split(",")) for need in extras[name]]
    known += re.findall(r"pip install[^`\n]* (\w+)`", text)
    have = {re.match(r"[\w-]+", need)[0].lower() for need in known} | {"lowalt"}
    offers = packages_of_modules()
    # A package that the page itself makes.
    have |= set(re.findall(r'title="[^"]*?(\w+)/__init__\.py"', text))
    sources = {
        module: {name.lower() for name in offers.get(module, [module])} for module in modules
    }
    assert not {
        module
        for module, names in sources.items()
        if module not in sys.stdlib_module_names and not names & have
    }


def test_every_target_of_make_exists():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    asked = [command.split() for _, command in NAMED if command.startswith("make ")]
    wanted = {words[1] for words in asked if words[1] != "-C"}
    assert len(wanted) > 8 and not wanted - targets
    for folder, target in (words[2:4] for words in asked if words[1] == "-C"):
        assert re.search(rf"^{target}:", (ROOT / folder / "Makefile").read_text(), re.MULTILINE), (
            folder,
            target,
        )


def test_every_target_that_make_help_lists_stands_in_a_document():
    listed = set(re.findall(r"^([a-z-]+):.*##", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = {command.split()[1] for _, command in NAMED if command.startswith("make ")}
    assert 10 < len(listed) <= 15 and not listed - named


@pytest.mark.parametrize("page", [page.relative_to(ROOT).as_posix() for page in PAGES])
def test_every_link_and_every_file_of_a_command_exists(page):
    text = (ROOT / page).read_text()
    plain = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    links = [link for link in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", plain) if link]
    missing = [link for link in links if not ((ROOT / page).parent / link).exists()]
    files = re.findall(
        r"(?<![\w./])(?:config|workflow|design|src|envs|benchmarks|profiles)/[\w./-]+\.\w+", plain
    )
    made = re.findall(r'title="([^"]+)"', text)
    missing += [name for name in files if name not in made and not (ROOT / name).exists()]
    assert not missing


def test_every_function_on_the_page_of_physics_exists():
    named = re.findall(r"`(lowalt(?:\.\w+)+\.\w+)`", PHYSICS)
    assert len(named) > 20
    for name in named:
        if name.startswith("lowalt.recognition"):
            pytest.importorskip("torch")
        module, _, function = name.rpartition(".")
        assert callable(getattr(importlib.import_module(module), function)), name


def test_every_effect_has_its_law_and_its_source_on_the_page_of_effects():
    sections = effects_page().split("\n### ")[1:]
    assert [section.split("\n")[0] for section in sections] == list(PLACES)
    for section in sections:
        law, source = section.split("\n\n*Source:* ")
        assert len(law.split()) > 8 and len(source.split()) > 2, section


def test_every_equation_stands_on_the_page_of_physics():
    numbers = set()
    for first in re.findall(r"^\| (\d[\d, to]*) \|", PHYSICS, re.MULTILINE):
        for part in first.split(","):
            ends = [int(number) for number in part.split("to")]
            numbers |= set(range(ends[0], ends[-1] + 1))
    assert numbers == set(range(1, 42))


def test_every_overlay_that_a_document_shows_is_a_configuration_s(tmp_path):
    text = "".join(page.read_text() for page in PAGES)
    shown = {
        overlay
        for some in re.findall(r"overlay with ((?:`[^`]+`(?:, | and )?)+)", text)
        for overlay in re.findall(r"`([a-z]+: \{[^`]+)`", some)
    }
    assert len(shown) > 12
    for overlay in sorted(shown):
        (tmp_path / "mine.yaml").write_text(f"run: mine\n{overlay}\n")
        load(
            [ROOT / "config/default.yaml", tmp_path / "mine.yaml"],
            ROOT / "workflow/schemas/config.schema.yaml",
        )


def test_every_effect_stands_on_the_page_of_scenes():
    text = (ROOT / "docs/scenes.md").read_text()
    assert not [name for name in PLACES if f"`{name}`" not in text]


def test_the_page_of_keys_says_type_range_and_meaning_of_inner_keys():
    inner = {"type": ["number", "null"], "minimum": 2, "description": "a | b"}
    block = {
        "type": "object",
        "description": "things",
        "additionalProperties": {"properties": {"far_m": inner}},
    }
    text = configuration_page(
        {"properties": {"seed": {"type": "integer", "description": "root"}, "sites": block}}
    )
    assert "| `seed` | integer | root |\n" in text
    assert "## sites\n\nThings.\n" in text
    assert "| `NAME.far_m` | number or null, at least 2 | a \\| b |\n" in text
    with pytest.raises(InputError, match="properties"):
        configuration_page({"type": "object"})


def test_links_lead_to_the_same_files_in_the_site_as_in_the_repository(monkeypatch):
    pytest.importorskip("mkdocs")
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    site = importlib.import_module("site_pages")
    found = site.relinked(
        "[a](../design/echo.md#what) [b](tutorials/target.md) ![c](../design/pictures/tiles.png)",
        "docs/tasks.md",
    )
    assert (
        found == "[a](design/echo.md#what) [b](tutorials/target.md) ![c](design/pictures/tiles.png)"
    )
    assert (
        site.relinked("[a](docs/index.md) [b](config)", "CONTRIBUTING.md")
        == "[a](index.md) [b](config/README.md)"
    )
    assert site.relinked("[a](../README.md)", "docs/none.md") == "[a](README.md)"
    assert site.relinked("[a](nowhere.md)", "docs/index.md") == "[a](nowhere.md)"
    assert site.relinked(f"[a](../{site.RECORDS})", "docs/index.md") == "[a](reference/records.md)"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site."""
    pytest.importorskip("mkdocs")
    pytest.importorskip("mkdocstrings")
    folder = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "--site-dir",
        str(folder),
    ]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment)
    assert run.returncode == 0, run.stderr
    return folder


def test_the_site_builds_without_a_warning_and_with_every_link(site):
    page = (site / "reference/library.html").read_text()
    assert "An endless sequence of samples" in page
    assert (site / "design/pictures/tiles.png").is_file()
    assert "<code>models_per_chunk</code>" in (site / "reference/configuration.html").read_text()
    elsewhere = re.compile(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?:https?:)?//')
    asking = [path.name for path in site.rglob("*.html") if elsewhere.search(path.read_text())]
    assert not asking


def told(found: str) -> list:
    """What a page's script left in the attribute `data-said` of the body, read as JSON."""
    return json.loads(html.unescape(re.search(r'data-said="(.*?)"', found, re.DOTALL)[1]))


def test_the_site_s_viewer_shows_each_target_with_and_without_each_effect(site):
    text = (site / "viewer.html").read_text()
    assert (site / "viewer.html").stat().st_size < 5e6
    script = """
    const at = (name) => document.getElementById("viewer-" + name);
    const tile = () => document.querySelector("image.tile").getAttribute("href");
    const choose = (name, value) => { at(name).value = value; at(name).dispatchEvent(new Event("change")); };
    const options = (name) => [...at(name).options].map((option) => option.value);
    const seen = new Set();
    for (const subtype of options("subtype")) {
      choose("subtype", subtype);
      for (const snr of options("snr")) {
        choose("snr", snr);
        for (const effect of options("effect")) { choose("effect", effect); seen.add(tile()); }
      }
    }
    const truths = [...document.querySelectorAll("image.truth")].filter((image) => image.getAttribute("href").length > 200);
    document.body.dataset.said = JSON.stringify([["subtype", "station", "snr", "effect"].map(options), seen.size, truths.length]);
    """
    choices, tiles, truths = told(browsed(site, text, script))
    config = overlaid([ROOT / "config/viewer.yaml"])
    subtypes, stations, snrs, effects = choices
    assert set(subtypes) == set(config["targets"]["select"])
    assert stations == [*config["network"]["stations"], "all"]
    assert set(snrs) == {"8 dB", "no noise"}
    assert effects == ["none", *config["effects"]]
    assert tiles == len(subtypes) * len(snrs) * len(effects)
    assert truths == len(config["network"]["stations"])


def test_a_window_of_1280_pixels_shows_every_tab_and_the_benchmark_s_tables_sort(site):
    script = """
    const rows = () => [...document.querySelectorAll(".sortable table")[0].tBodies[0].rows];
    const tabs = [...document.querySelectorAll(".md-tabs__link")].map((tab) => tab.getBoundingClientRect().right);
    document.querySelectorAll(".sortable th button")[2].click();
    const numbers = rows().map((row) => parseFloat(row.cells[2].textContent));
    const heights = rows().map((row) => row.cells[2].getBoundingClientRect().height);
    document.body.dataset.said = JSON.stringify([window.innerWidth, Math.max(...tabs), numbers, Math.max(...heights)]);
    """
    wide, last_tab, numbers, height = told(
        browsed(site, (site / "benchmark.html").read_text(), script)
    )
    assert wide == 1280 and last_tab <= 1280
    assert len(numbers) > 9 and numbers == sorted(numbers)
    # A cell is one line.
    assert height < 50


def test_every_page_of_the_site_exists_and_every_page_is_in_the_site():
    nav = yaml.safe_load((ROOT / "mkdocs.yml").read_text())["nav"]

    def pages(entry):
        below = entry.values() if isinstance(entry, dict) else entry
        return (
            [entry]
            if isinstance(entry, str)
            else [name for value in below for name in pages(value)]
        )

    # These pages are made as the site is built.
    made = {f"reference/{name}.md" for name in ("configuration", "records", "effects")}
    every_name = set(pages(nav)) - made
    named = {f"docs/{name}" if (ROOT / "docs" / name).is_file() else name for name in every_name}
    assert not [name for name in named if not (ROOT / name).is_file()]
    every = {page.relative_to(ROOT).as_posix() for page in [*PAGES, *ROOT.glob("design/*.md")]} - {
        "README.md"
    }
    assert every <= named


FOLLOWED = {
    "tests/test_tutorials.py": (
        "first_data_set",
        "trajectory",
        "effect",
        "backbone",
        "pytorch",
        "hugging_face",
    ),
    "tests/config/test_strangers_package.py": ("extension",),
    "tests/extensions/benchmark/test_benchmark_tutorial.py": ("benchmark",),
    "tests/extensions/drafting/test_drafting_tutorial.py": ("target",),
    "tests/extensions/recordings/test_recordings_tutorial.py": ("recording",),
}
"""The tutorials that each file of tests follows, block by block."""


def test_every_tutorial_is_followed_by_a_test():
    tutorials = sorted(path.stem for path in (ROOT / "docs/tutorials").glob("*.md"))
    assert sorted(page for pages in FOLLOWED.values() for page in pages) == tutorials
    for test, pages in FOLLOWED.items():
        text = (ROOT / test).read_text()
        assert not [page for page in pages if f'"{page}"' not in text and f"{page}.md" not in text]
