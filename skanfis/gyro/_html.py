"""A page of HTML that needs nothing but itself: style inside, pictures as data, no scripts."""

import base64
import html
import io

__all__ = ["Page"]

_DOTS_PER_INCH = 160

_STYLE = """
:root { color-scheme: light; --ink: #1c2430; --soft: #5b6675; --line: #e3e7ec; --paper: #ffffff;
  --ground: #f4f6f8; --accent: #0072b2; --warn: #a84300; --warn-ground: #fff4ea; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }
body { margin: 0; background: var(--ground); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 28px 24px 56px; }
header { margin-bottom: 20px; }
h1 { font-size: 1.75rem; line-height: 1.25; margin: 0 0 4px; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 0 0 6px; }
h3 { font-size: 1rem; margin: 18px 0 6px; }
p { margin: 0 0 10px; max-width: 78ch; overflow-wrap: break-word; }
.soft, figcaption, caption { color: var(--soft); }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
  padding: 20px 22px; margin: 0 0 18px; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(165px, 1fr)); gap: 12px;
  margin: 0 0 18px; padding: 0; }
.cards div { background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
  padding: 12px 16px; }
.cards dt { color: var(--soft); font-size: .85rem; }
.cards dd { margin: 2px 0 0; font-size: 1.1rem; font-weight: 650; line-height: 1.25;
  font-variant-numeric: tabular-nums; overflow-wrap: anywhere; }
.cards small { display: block; font-size: .82rem; font-weight: 400; color: var(--soft); }
.figures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 440px), 1fr));
  gap: 22px; align-items: start; margin-top: 12px; }
figure { margin: 0; min-width: 0; }
figure img { display: block; width: 100%; height: auto; }
figcaption { font-size: .9rem; margin-top: 4px; }
.scroll { overflow-x: auto; margin: 8px 0 12px; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; padding-bottom: 6px; font-size: .9rem; }
th, td { text-align: right; padding: 5px 12px; border-bottom: 1px solid var(--line);
  white-space: nowrap; vertical-align: top; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
th.text, td.text { text-align: left; }
td span { color: var(--soft); }
thead th { border-bottom: 2px solid var(--ink); font-weight: 600; }
tbody tr:hover { background: var(--ground); }
.warn { background: var(--warn-ground); border-left: 4px solid var(--warn); padding: 10px 14px;
  border-radius: 4px; margin: 0 0 12px; max-width: none; }
pre { background: var(--ground); border-radius: 6px; padding: 12px 14px; overflow-x: auto;
  font: 13px/1.5 ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; margin: 8px 0; }
details { margin-top: 8px; } summary { cursor: pointer; font-weight: 600; }
footer { color: var(--soft); font-size: .85rem; }
@media (max-width: 600px) { main { padding: 16px 12px 40px; } section { padding: 16px 14px; }
  h1 { font-size: 1.4rem; } .cards { grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 8px; }
  .cards div { padding: 10px 12px; } .cards dd { font-size: 1.1rem; }
  table { font-size: .82rem; } th, td { padding: 4px 7px; } td span { display: block; }
  th { white-space: normal; } th:first-child, td:first-child { white-space: normal; } }
@media print { body { background: none; } section { break-inside: avoid; border: 0; padding: 0; } }
"""


class Page:
    """A page that is built from top to bottom; all text is escaped."""

    def __init__(self, title, subtitle):
        self._title = title
        self._parts = [f"<header><h1>{_text(title)}</h1>", f'<p class="soft">{_text(subtitle)}</p>']
        self._parts.append("</header>")
        self._is_open = False

    def section(self, title):
        """Begin a section; the one before ends."""
        self._end()
        self._parts.append(f"<section><h2>{_text(title)}</h2>")
        self._is_open = True

    def heading(self, title):
        self._parts.append(f"<h3>{_text(title)}</h3>")

    def paragraph(self, text, kind=""):
        """A paragraph; its kind may be "warn" or "soft"."""
        attribute = f' class="{kind}"' if kind else ""
        self._parts.append(f"<p{attribute}>{_text(text)}</p>")

    def cards(self, facts):
        """Figures that are seen first: (what, value, remark)."""
        self._end()
        items = [
            f"<div><dt>{_text(what)}</dt><dd>{_text(value)}<small>{_text(remark)}</small></dd></div>"
            for what, value, remark in facts
        ]
        self._parts += ['<dl class="cards">', *items, "</dl>"]

    def table(self, head, rows, caption=""):
        """A table: numbers to the right, the first column and units to the left.

        A cell is a string, or a pair of strings, the second of less weight.
        """
        kinds = [' class="text"' if name == "unit" else "" for name in head]
        title = f"<caption>{_text(caption)}</caption>" if caption else ""
        header = "".join(
            f'<th scope="col"{kind}>{_text(name)}</th>'
            for name, kind in zip(head, kinds, strict=True)
        )
        lines = [
            "<tr>"
            + "".join(
                f"<td{kind}>{_cell(cell)}</td>" for cell, kind in zip(row, kinds, strict=True)
            )
            + "</tr>"
            for row in rows
        ]
        self._parts += [
            f'<div class="scroll" tabindex="0"><table>{title}<thead><tr>{header}</tr></thead>',
            "<tbody>",
            *lines,
            "</tbody></table></div>",
        ]

    def figures(self, entries):
        """Pictures, side by side where there is room: (figure, what it shows, caption)."""
        self._parts.append('<div class="figures">')
        for figure, alt, caption in entries:
            source = f"data:image/png;base64,{base64.b64encode(_png(figure)).decode('ascii')}"
            self._parts.append(
                f'<figure><img alt="{_text(alt)}" src="{source}">'
                f"<figcaption>{_text(caption)}</figcaption></figure>"
            )
        self._parts.append("</div>")

    def preformatted(self, text, summary):
        """Long text that is opened by a click."""
        self._parts.append(
            f"<details><summary>{_text(summary)}</summary><pre>{_text(text)}</pre></details>"
        )

    def footer(self, text):
        self._end()
        self._parts.append(f"<footer>{_text(text)}</footer>")

    def render(self):
        """The page as one string."""
        self._end()
        return "\n".join(
            [
                "<!DOCTYPE html>",
                '<html lang="en"><head><meta charset="utf-8">',
                '<meta name="viewport" content="width=device-width, initial-scale=1">',
                # A page from a calibration needs no other address: a browser is told so.
                '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
                "img-src data:; style-src 'unsafe-inline'\">",
                f"<title>{_text(self._title)}</title><style>{_STYLE}</style></head><body><main>",
                *self._parts,
                "</main></body></html>\n",
            ]
        )

    def _end(self):
        if self._is_open:
            self._parts.append("</section>")
            self._is_open = False


def _cell(content):
    if isinstance(content, str):
        return _text(content)
    value, detail = content
    return f"{_text(value)} <span>{_text(detail)}</span>" if detail else _text(value)


def _text(value):
    return html.escape(str(value))


def _png(figure):
    file = io.BytesIO()
    # Software and date would make two reports on the same log differ.
    figure.savefig(file, format="png", dpi=_DOTS_PER_INCH, metadata={"Software": None})
    return file.getvalue()
