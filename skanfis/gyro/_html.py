"""A page of HTML that needs nothing but itself: style inside, pictures as data, no scripts."""

import base64
import html
import io

from ..inspection.labels import printable
from ._style_sheet import STYLE

__all__ = ["Page"]

# Sharp in print.
_DOTS_PER_INCH = 160
# Tables up to this are kept on one page in print.
_MOST_ROWS_ON_A_PAGE = 25
# Of columns that are not numbers.
_KINDS = {
    "unit": "text",
    "required": "text",
    "result": "text long",
    "entry": "text long",
    "SHA-256": "text hash",
}
_JUDGEMENTS = ("pass", "fail", "not measured")


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

    def banner(self, title, sentences, kind):
        """What must be seen first; its kind is "good" or "bad"."""
        self._end()
        lines = "".join(f"<p>{_text(sentence)}</p>" for sentence in sentences)
        self._parts.append(f'<div class="banner {kind}"><h2>{_text(title)}</h2>{lines}</div>')

    def cards(self, facts):
        """Figures that are seen first: (what, value, remark)."""
        self._end()
        items = [
            f"<div><dt>{_text(what)}</dt><dd>{_text(value)}<small>{_text(remark)}</small></dd></div>"
            for what, value, remark in facts
        ]
        self._parts += ['<dl class="cards">', *items, "</dl>"]

    def table(self, head, rows, caption=""):
        """A table: numbers to the right, the first column and words to the left.

        A cell is a string, or a pair of strings, the second of less weight. A cell "pass" or "fail"
        is coloured.
        """
        kinds = [f' class="{_KINDS[name]}"' if name in _KINDS else "" for name in head]
        title = f"<caption>{_text(caption)}</caption>" if caption else ""
        header = "".join(
            f'<th scope="col"{kind}>{_text(name)}</th>'
            for name, kind in zip(head, kinds, strict=True)
        )
        # Longer ones break between pages.
        short = " short" if len(rows) <= _MOST_ROWS_ON_A_PAGE else ""
        lines = [
            "<tr>"
            + "".join(
                f"<td{kind}>{_cell(cell)}</td>" for cell, kind in zip(row, kinds, strict=True)
            )
            + "</tr>"
            for row in rows
        ]
        self._parts += [
            f'<div class="scroll{short}" tabindex="0"><table>{title}',
            f"<thead><tr>{header}</tr></thead>",
            "<tbody>",
            *lines,
            "</tbody></table></div>",
        ]

    def figures(self, pictures):
        """Pictures, side by side where there is room, with the data behind each of them."""
        self._parts.append('<div class="figures">')
        for picture in pictures:
            source = f"data:image/png;base64,{_base64(_png(picture.figure))}"
            width, height = picture.figure.get_size_inches()
            kind = ' class="tall"' if height > width else ""
            self._parts.append(
                f'<figure{kind}><img alt="{_text(picture.alt)}" src="{source}">'
                f"<figcaption>{_text(picture.caption)}"
            )
            for name, text in picture.files.items():
                self.download(name, text)
            self._parts.append("</figcaption></figure>")
        self._parts.append("</div>")

    def download(self, name, text):
        """A file of its own within the page, which a click saves."""
        source = f"data:text/csv;charset=utf-8;base64,{_base64(text.encode('utf-8'))}"
        self._parts.append(
            f' <a class="data" download="{_text(name)}" href="{source}">{_text(name)}</a>'
        )

    def preformatted(self, text, summary, is_open=False):
        """Long text that is opened by a click, or is open already."""
        attribute = " open" if is_open else ""
        self._parts.append(
            f"<details{attribute}><summary>{_text(summary)}</summary>"
            f"<pre>{_text(text)}</pre></details>"
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
                f"<title>{_text(self._title)}</title><style>{STYLE}</style></head><body><main>",
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
    if value in _JUDGEMENTS:
        value, after = f'<b class="{value[:4]}">{value}</b>', f" <span>{_text(detail)}</span>"
        return value + (after if detail else "")
    return f"{_text(value)} <span>{_text(detail)}</span>" if detail else _text(value)


def _text(value):
    # Line ends stand in preformatted text; other signs that nobody sees are no text.
    return html.escape("\n".join(printable(line) for line in str(value).split("\n")))


def _base64(data):
    return base64.b64encode(data).decode("ascii")


def _png(figure):
    file = io.BytesIO()
    # Software and date would make two reports on the same log differ.
    figure.savefig(file, format="png", dpi=_DOTS_PER_INCH, metadata={"Software": None})
    return file.getvalue()
