"""Formulas as MathML, made when the pages are built: browsers draw them without a script.

Every current browser lays MathML out itself, so that pages read from a disk or behind a firewall
show their formulas. docutils has the converter from LaTeX; a formula that it cannot read fails the
build. Systems without a font for mathematics get the one that ziamath carries, STIX Two.
"""

import html
import re
from pathlib import Path
from xml.etree import ElementTree

import ziamath
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


NAMESPACE = "http://www.w3.org/1998/Math/MathML"
TAG = f"{{{NAMESPACE}}}"
ACCENTS = "\u02c9\u02c6\u02dc"  # bar, hat, tilde
BARS = ("|", "\u2016")  # of an absolute value, of a norm
FONTS = Path(ziamath.__file__).parent / "fonts"


def to_mathml(latex, is_block):
    """MathML of a formula; ExtensionError where it cannot be read."""
    spelled = latex
    for pattern, other in _SPELLED.items():
        spelled = re.sub(pattern, other, spelled)
    try:
        return beside(tex2mathml(" ".join(spelled.split()), as_block=is_block))
    except (nodes.SkipNode, SyntaxError, ValueError, IndexError) as error:
        raise ExtensionError(
            f"formula that MathML cannot be made of: {latex!r}: {error}"
        ) from error


def beside(mathml):
    """MathML with indices beside what has an accent, not beneath, and bars as tall as text."""
    ElementTree.register_namespace("", NAMESPACE)
    # XML knows but five of HTML's names of characters.
    named = re.sub(r"&(?!lt;|gt;|amp;)\w+;", lambda name: html.unescape(name[0]), mathml)
    tree = ElementTree.fromstring(named)
    for bar in tree.iter(TAG + "mo"):
        if bar.text in BARS:
            bar.attrib.setdefault("stretchy", "false")
            bar.attrib |= {"lspace": "0", "rspace": "0"}
    for node in tree.iter(TAG + "munderover"):
        base, index, accent = node
        if base.tag == TAG + "mi" and (accent.text or "") in ACCENTS:
            accented = ElementTree.Element(TAG + "mover", accent="true")
            accented.extend([base, accent])
            node.tag = TAG + "msub"
            node[:] = [accented, index]
    return ElementTree.tostring(tree, encoding="unicode")


def visit_inline(self, node):
    self.body.append(f'<span class="math">{to_mathml(node.astext(), is_block=False)}</span>')
    raise nodes.SkipNode


def visit_block(self, node):
    self.body.append(self.starttag(node, "div", CLASS="math"))
    self.body.append(to_mathml(node.astext(), is_block=True))
    self.body.append("</div>\n")
    raise nodes.SkipNode


def add_font(app, config):
    config.html_static_path.append(str(FONTS))


def setup(app):
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.connect("config-inited", add_font)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
