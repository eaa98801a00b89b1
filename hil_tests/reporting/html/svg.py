"""Drawings as static SVG: elements with escaped attributes and texts, nothing else.

No `style` attributes: the report's content security policy forbids them. Colours come from
classes, so that a drawing follows light, dark and print.
"""

from __future__ import annotations

from collections.abc import Iterable

from markupsafe import Markup, escape


def element(name: str, *children: Markup, text: object = None, **attributes: object) -> Markup:
    """An element; `class_` is written `class`, and underscores become hyphens.

    Args:
        name: of the element.
        children: elements inside it, made by this function.
        text: its text, escaped.
        attributes: None leaves one out; numbers are cut to two decimals.
    """
    written = [
        Markup(' {}="{}"').format(key.rstrip("_").replace("_", "-"), _value(value))
        for key, value in attributes.items()
        if value is not None
    ]
    inner = Markup("").join(children)
    if text is not None:
        inner = escape(str(text)) + inner
    return Markup("<{}{}>{}</{}>").format(name, Markup("").join(written), inner, name)


def _value(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def line(x1: float, y1: float, x2: float, y2: float, class_: str) -> Markup:
    """A straight line."""
    return element("line", x1=float(x1), y1=float(y1), x2=float(x2), y2=float(y2), class_=class_)


def rect(x: float, y: float, width: float, height: float, class_: str, title: str = "") -> Markup:
    """A rectangle; the pointer shows its title."""
    inner = [element("title", text=title)] if title else []
    sizes = {"width": float(max(width, 0)), "height": float(max(height, 0))}
    return element("rect", *inner, x=float(x), y=float(y), class_=class_, **sizes)


def label(x: float, y: float, text: str, class_: str = "", anchor: str = "start") -> Markup:
    """A line of text."""
    return element(
        "text", text=text, x=float(x), y=float(y), class_=class_ or None,
        text_anchor=anchor if anchor != "start" else None,
    )  # fmt: skip


def drawing(
    width: int, height: int, title: str, parts: Iterable[Markup], class_: str = "plot"
) -> Markup:
    """A whole drawing, with its title for those who do not see it."""
    return element(
        "svg",
        element("title", text=title),
        *parts,
        viewBox=f"0 0 {width} {height}",
        width=width,
        height=height,
        role="img",
        aria_label=title,
        class_=class_,
    )
