"""A page read back: its addresses, links, headings and tables; and what a headless Chromium makes
of it.
"""

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

VOID = {"meta", "link", "img", "input", "br", "hr", "image", "line", "rect"}


class Page(HTMLParser):
    """The structure of a page; `faults` lists tags that do not close in their order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open = []
        self.faults = []
        self.ids = []
        self.links = []
        self.sources = []
        self.tables = []
        self.pictures = []
        self._cell = None
        self.feed(text)
        self.faults += [f"{tag} is not closed" for tag in self.open]

    def handle_starttag(self, tag, attrs):
        """Note an opened tag, its name as a target and its link."""
        found = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        if "id" in found:
            self.ids.append(found["id"])
        if tag == "a":
            self.links.append(found.get("href"))
        if "src" in found:
            self.sources.append(found["src"])
        if tag == "img":
            self.pictures.append(found.get("alt"))
        if tag == "table":
            self.tables.append({"caption": "", "head": [], "rows": []})
        if tag == "tr" and "tbody" in self.open:
            self.tables[-1]["rows"].append([])
        if tag in ("th", "td", "caption"):
            self._cell = ""

    def handle_startendtag(self, tag, attrs):
        """Note a tag that closes itself."""
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_data(self, data):
        """Collect the text of a table cell."""
        if self._cell is not None:
            self._cell += data

    def handle_endtag(self, tag):
        """Note a closed tag, and a fault where it was not the last one opened."""
        if tag in VOID:
            return
        if not self.open or self.open[-1] != tag:
            self.faults.append(f"{tag} closes {self.open[-1:]}")
        if tag in self.open:
            del self.open[len(self.open) - 1 - self.open[::-1].index(tag) :]
        if tag in ("th", "td", "caption"):
            text = " ".join(self._cell.split())
            self._cell = None
            if tag == "caption":
                self.tables[-1]["caption"] = text
            elif "thead" in self.open:
                self.tables[-1]["head"].append(text)
            else:
                self.tables[-1]["rows"][-1].append(text)


def sound(text: str) -> Page:
    """Return the page; assert that it parses, needs no network, and that links and tables are
    whole.
    """
    page = Page(text)
    assert not page.faults
    assert len(set(page.ids)) == len(page.ids)
    inside = {link[1:] for link in page.links if link.startswith("#")}
    assert inside and inside <= set(page.ids)
    assert not [link for link in page.links if ":" in link or link.startswith("/")]
    assert all(source.startswith("data:") for source in page.sources)
    assert all(page.pictures) and "http" not in re.sub(
        r"https?://www\.w3\.org/\S+", "", text.partition("<body>")[0]
    )
    for table in page.tables:
        assert table["caption"] and table["rows"]
        assert {len(row) for row in table["rows"]} == {len(table["head"])}
    return page


def browsed(folder: Path, text: str, script: str = "") -> str:
    """Return the page's HTML after its scripts, then `script`, ran in Chromium; skips the test
    where there is none.

    Fails where the console shows an error.
    """
    browser = (
        shutil.which("chromium")
        or shutil.which("chromium-browser")
        or shutil.which("google-chrome")
    )
    if browser is None:
        pytest.skip(
            "no Chromium on this machine, expected the command chromium: the page's scripts were "
            "not run"
        )
    path = folder / "page.html"
    path.write_text(text.replace("</body>", f"<script>{script}</script></body>"))
    flags = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-background-networking",
        "--disable-component-update",
        "--no-first-run",
        # There is no network: a page that asks for anything shows an error.
        "--host-resolver-rules=MAP * ~NOTFOUND",
        "--window-size=1280,900",
        "--enable-logging=stderr",
        f"--user-data-dir={folder}/user",
    ]
    # Virtual time that is idle passes at once. Plots are drawn only when they come into view, on a
    # busy machine late.
    command = [browser, *flags, "--virtual-time-budget=20000", "--dump-dom", path.as_uri()]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stderr
    wrong = [line for line in ran.stderr.splitlines() if "CONSOLE" in line]
    assert not wrong
    return ran.stdout


def narrow(folder: Path, text: str, script: str) -> str:
    """Return `browsed` of an empty page that holds the page `text` in a frame as wide as a
    telephone; `script` runs when it is loaded and knows it as `frame`.
    """
    inner = json.dumps(text).replace("</", "<\\/")
    outer = """
    const frame = document.createElement("iframe");
    frame.style.width = "390px"; frame.style.height = "3000px"; frame.style.border = "0";
    frame.srcdoc = INNER;
    frame.onload = () => { SCRIPT };
    document.body.append(frame);
    """.replace("SCRIPT", script).replace("INNER", inner)
    return browsed(folder, "<body></body>", outer)
