"""Formulas as MathML, made when the pages are built: browsers draw them without a script.

Every current browser lays MathML out itself, so that pages read from a disk or behind a firewall
show their formulas. docutils has the converter from LaTeX; a formula that it cannot read fails the
build.
"""

import re

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.errors import ExtensionError

# Spellings that the converter does not know, by one that it does.
_SPELLED = {
    r"\\dots\b": r"\\ldots",
    r"\\[td]?frac *(\w)(\w)": r"\\frac{\1}{\2}",
    r"\\(text|display)style\b": "",
    r"\\operatorname\*": r"\\operatorname",
    r"\\[Bb]ig+l(?![a-z])": r"\\left",
    r"\\[Bb]ig+r(?![a-z])": r"\\right",
}


def to_mathml(latex, is_block):
    """MathML of a formula; ExtensionError where it cannot be read."""
    spelled = latex
    for pattern, other in _SPELLED.items():
        spelled = re.sub(pattern, other, spelled)
    try:
        return tex2mathml(" ".join(spelled.split()), as_block=is_block)
    except (nodes.SkipNode, SyntaxError, ValueError, IndexError) as error:
        raise ExtensionError(f"formula that MathML cannot be made of: {latex!r}: {error}") from error


def visit_inline(self, node):
    self.body.append(f'<span class="math">{to_mathml(node.astext(), is_block=False)}</span>')
    raise nodes.SkipNode


def visit_block(self, node):
    self.body.append(self.starttag(node, "div", CLASS="math"))
    self.body.append(to_mathml(node.astext(), is_block=True))
    self.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
