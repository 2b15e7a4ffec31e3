"""The report's command: how many sections it makes at a time, and that each stands where it belongs."""

from types import SimpleNamespace

import pytest

from lowalt.report import __main__ as command
from lowalt.report.page import SECTIONS, Section


@pytest.mark.parametrize(("given", "jobs"), [([], 1), (["--jobs", "3"], 3)])
def test_sections_are_made_as_many_at_a_time_as_asked_and_keep_their_names(tmp_path, monkeypatch, given, jobs):
    reported, asked, shown = SimpleNamespace(shards=[]), [], {}

    def together(calls, at_a_time):
        """Give each section its own name as HTML, and one plot."""
        asked.append((at_a_time, len(calls)))
        assert [call.args for call in calls[2:]] == [(reported, name) for name in SECTIONS]
        return ["script", None, *(Section(call.args[1], [call.args[1]]) for call in calls[2:])]

    def page(run, sections, script):
        shown.update(sections, script=script)
        return "page"

    monkeypatch.setattr(command, "together", together)
    monkeypatch.setattr(command, "page", page)
    monkeypatch.setattr(command, "ReportedRun", lambda *_: reported)
    monkeypatch.setattr(command, "Inputs", SimpleNamespace(read=lambda path: path))
    monkeypatch.setattr(command, "write_stages", lambda *_: None)
    monkeypatch.setattr(command, "write_plots", lambda folder, plots: shown.update(plots=plots))
    settings = ["--settings", '{"config": {}, "published": {}}', "--manifest", "m.json", "--stages", "s.csv"]
    command.main([*settings, "--figures", str(tmp_path), "--out", str(tmp_path / "page.html"), *given])
    assert asked == [(jobs, len(SECTIONS) + 2)]
    assert (tmp_path / "page.html").read_text() == "page"
    assert shown.pop("script") == "script" and shown.pop("plots") == list(SECTIONS)
    assert {name: section.html for name, section in shown.items()} == {name: name for name in SECTIONS}
