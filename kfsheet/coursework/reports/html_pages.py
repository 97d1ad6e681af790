"""Pages of HTML: a frame and tables, in which whatever came from a student is escaped."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

STYLE = """<style>
body { font: 15px/1.5 sans-serif; max-width: 60em; margin: 2em auto; color: #222; }
table { border-collapse: collapse; } td, th { border: 1px solid #bbb; padding: .3em .6em;
text-align: left; vertical-align: top; } .full { background: #c6efce; }
.part { background: #ffeb9c; } .none { background: #ffc7ce; }
</style>"""


def page(title: str, body: str) -> str:
    """A whole page; ``body`` is HTML."""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title>{STYLE}'
    return f"<!doctype html><html><head>{head}</head><body>{body}</body></html>\n"


def table(head: Iterable[str], rows: Iterable[tuple[str, Iterable[object]]]) -> str:
    """Rows as pairs of a kind, which colours them, and their cells."""
    top = "".join(f"<th>{escape(word)}</th>" for word in head)
    lines = "".join(
        f'<tr class="{kind}">' + "".join(f"<td>{escape(str(v))}</td>" for v in values) + "</tr>"
        for kind, values in rows
    )
    return f"<table><tr>{top}</tr>{lines}</table>"
