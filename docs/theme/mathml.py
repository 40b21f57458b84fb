"""Formulas as MathML when the site is built: a page then needs no script and no network to show them.

`pymdownx.arithmatex` finds the formulas, `latex2mathml` converts them; this puts the one in the place of the other.
"""

from html import unescape
from xml.etree.ElementTree import Element

from latex2mathml.converter import convert_to_element
from markdown import Extension, Markdown
from markdown.treeprocessors import Treeprocessor

OPENING, CLOSING = (r"\(", r"\["), (r"\)", r"\]")
AFTER_INLINE_PATTERNS = 15
"""priority of the tree processor: the patterns run at 20"""


class _Formulas(Treeprocessor):
    def run(self, root: Element) -> None:
        for holder in root.iter():
            if "arithmatex" in holder.get("class", "").split():
                text = unescape(holder.text or "").strip()
                if not (text.startswith(OPENING) and text.endswith(CLOSING)):
                    raise ValueError(f"no formula: {text}")
                holder.text = None
                display = "block" if text.startswith(r"\[") else "inline"
                try:
                    convert_to_element(text[2:-2].strip(), display=display, parent=holder)
                except Exception as error:
                    raise ValueError(f"{type(error).__name__} in the formula {text}") from error


class _MathML(Extension):
    def extendMarkdown(self, md: Markdown) -> None:  # noqa: N802
        md.treeprocessors.register(_Formulas(md), "mathml", AFTER_INLINE_PATTERNS)


def makeExtension(**options: object) -> Extension:  # noqa: N802
    """For Python-Markdown, which looks for this name in `docs.theme.mathml`."""
    return _MathML(**options)
