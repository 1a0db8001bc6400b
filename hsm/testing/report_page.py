"""What the HTML pages of reports have in common: pages without scripts, in the colours of the reader's system."""

from __future__ import annotations

from html import escape

_STYLE = """
:root { color-scheme: light dark; --good: #2a7d4f22; --bad: #c0392b33; --part: #c8a02b33; --line: #8884; }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; }
table { border-collapse: collapse; }
th, td { border-bottom: 1px solid var(--line); }
.good { background: var(--good); }
.bad { background: var(--bad); }
.part { background: var(--part); }
"""


def report_page(title: str, style: str, body: str) -> str:
    """A page of a report.

    Args:
        title: of the window.
        style: rules of this page, which come after the common ones. These have the classes ``good``, ``part`` and
            ``bad``.
        body: HTML.
    """
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}{style.lstrip()}</style><body>{body}</body></html>\n"
    )
