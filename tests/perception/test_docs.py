"""The pages on perception: their pictures and links exist, their figures can be drawn."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [DOCS / "explanation" / "perception.md", DOCS / "reference" / "perception.md"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.parent.name)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8"))
    assert links
    for link in links:
        assert (page.parent / link).is_file(), link


def test_the_figures_can_be_drawn(tmp_path):
    script = runpy.run_path(str(DOCS.parent / "scripts" / "perception_figures.py"))
    main = script["main"]
    main.__globals__["IMAGES"] = tmp_path
    main()
    drawn = {path.name for path in tmp_path.iterdir()}
    assert drawn == {path.name for path in (DOCS / "images").glob("perception-*.png")}
