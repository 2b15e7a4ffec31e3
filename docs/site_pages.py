"""A hook of mkdocs: documents that lie elsewhere in the repository appear in the site, and links
between all work.

A file of docs/ has its path below docs/ in the site; every other file keeps its path in the
repository. Markdown files of the navigation become pages. Any other file that a page links to is
added to the site as it is. So the links that work in the repository work in the site, and every
text stands once. Pages of keys and of effects are made of the schemas and the effects' modules as
the site is built: links to a schema, or to the list of effects, lead to its page. The viewer of
samples is simulated as the site is built.
"""

import functools
import posixpath
import re
from pathlib import Path

from key_pages import configuration_page, effects_page, records_page
from mkdocs.structure.files import File

from lowalt.config.layers import overlaid
from lowalt.files.package_plan import PACKAGE
from lowalt.files.yaml_files import load_yaml
from lowalt.report.viewer_page import viewer_of

ROOT = Path(__file__).parents[1]
DOCS = "docs/"
CONFIGURATION = "workflow/schemas/config.schema.yaml"
RECORDS = "src/lowalt/targets/records.schema.yaml"
EFFECTS = "src/lowalt/scene/effects/__init__.py"
KEYS = {
    CONFIGURATION: "reference/configuration.md",
    RECORDS: "reference/records.md",
    EFFECTS: "reference/effects.md",
}
"""Files in the repository, and the pages of the site that are made of them."""
VIEWER = "viewer.md"
VIEWED = ROOT / "config/viewer.yaml"
"""The viewer's page of the site, and the configuration whose samples it shows."""
MARK = "<!-- viewer -->"
"""Where the viewer stands in its page."""
SHARED = ("tables.js", "tables.css")
"""Files of the report's page that the site uses as well."""
LINK = re.compile(r"\]\(([^)#\s:]+)((?:#[^)\s]*)?)\)")
"""A link or picture to a file, and its anchor; addresses with a scheme have a colon."""


def in_repository(uri: str) -> str:
    """Return the path in the repository of a file of the site."""
    return DOCS + uri if uri in KEYS.values() or (ROOT / DOCS / uri).is_file() else uri


def in_site(path: str) -> str:
    """Return the path in the site of a file of the repository."""
    return KEYS.get(path, path.removeprefix(DOCS))


def relinked(text: str, path: str) -> str:
    """Return the text of a page, its links turned from paths in the repository to paths in the
    site.

    path: the page's path in the repository. A folder's link leads to its README.md. Links to files
    that are not there stay as they are, so that mkdocs warns about them.
    """
    here = posixpath.dirname(path)
    place = posixpath.dirname(in_site(path))

    def turned(match: re.Match) -> str:
        """The link of a match as it must read in the site; unchanged where it names no file of the
        repository.
        """
        target = posixpath.normpath(posixpath.join(here, match[1]))
        if (ROOT / target).is_dir():
            target = f"{target}/README.md"
        if not (ROOT / target).is_file():
            return match[0]
        return f"]({posixpath.relpath(in_site(target), place or '.')}{match[2]})"

    return LINK.sub(turned, text)


def linked(text: str, path: str) -> set[str]:
    """Return the paths in the repository of the files that a page links to."""
    joined = {
        posixpath.normpath(posixpath.join(posixpath.dirname(path), match[1]))
        for match in LINK.finditer(text)
    }
    folders = {f"{name}/README.md" for name in joined if (ROOT / name).is_dir()}
    return {name for name in joined | folders if (ROOT / name).is_file()}


def pages(nav: list | dict | str) -> list[str]:
    """Return the paths of all pages of a navigation."""
    if isinstance(nav, str):
        return [nav]
    values = nav.values() if isinstance(nav, dict) else nav
    return [name for value in values for name in pages(value)]


def on_files(files, config):
    """Add the navigation's pages that lie outside docs/, and the files to which any page links."""
    made = {
        CONFIGURATION: configuration_page(load_yaml(ROOT / CONFIGURATION)),
        RECORDS: records_page(load_yaml(ROOT / RECORDS)),
        EFFECTS: effects_page(),
    }
    for name, content in made.items():
        files.append(File.generated(config, KEYS[name], content=content))
    named = [in_repository(uri) for uri in pages(config.nav) if uri not in KEYS.values()]
    wanted = set(named)
    for name in named:
        wanted |= {
            path
            for path in linked((ROOT / name).read_text(), name)
            if path in named or path[-3:] != ".md"
        }
    for name in SHARED:
        files.append(File.generated(config, name, abs_src_path=str(PACKAGE / "report" / name)))
    for path in sorted(wanted):
        if files.get_file_from_path(in_site(path)) is None:
            files.append(File.generated(config, in_site(path), abs_src_path=str(ROOT / path)))
    return files


def on_page_markdown(markdown, page, config, files):
    """Turn the links of a page."""
    return relinked(markdown, in_repository(page.file.src_uri))


@functools.cache
def viewer() -> str:
    """Return the viewer of the site as HTML, made once per process."""
    return viewer_of(overlaid([VIEWED]))


def on_post_page(output, page, config):
    """Put the viewer into its page, behind all that reads the texts of pages, such as the search."""
    return output.replace(MARK, viewer()) if page.file.src_uri == VIEWER else output
