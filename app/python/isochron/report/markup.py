"""HTML from Python: text is escaped unless it is markup already, so that no name in a file can become part of the page."""

import html
import json


class Markup(str):
    """Text that is HTML."""


def escape(value):
    return value if isinstance(value, Markup) else Markup(html.escape(str(value)))


def join(parts, separator=""):
    return Markup(separator.join(escape(part) for part in parts if part is not None))


VOID = {"img", "input", "meta", "link", "br"}


def element(tag, /, *children, **attributes):
    """An element; `class_`, `for_` and data_x become class, for and data-x. True: an attribute alone; None: none."""
    words = [tag]
    for key, value in attributes.items():
        key = key.rstrip("_").replace("_", "-")
        if value is True:
            words.append(key)
        elif value is not None and value is not False:
            words.append(f'{key}="{html.escape(str(value))}"')
    start = Markup(f"<{' '.join(words)}>")
    return start if tag in VOID else Markup(f"{start}{join(children)}</{tag}>")


def data_for_scripts(data, **attributes):
    """JSON that the page's script reads; nothing in it can end the element."""
    return element("script", Markup(json.dumps(data).replace("<", "\\u003c")), type="application/json", **attributes)


def table(head, rows, caption=None, class_=None):
    """The first cell of a row is its header."""
    caption = element("caption", caption) if caption else None
    top = element("thead", element("tr", *(element("th", cell, scope="col") for cell in head)))
    body = [element("tr", element("th", row[0], scope="row"), *(element("td", cell) for cell in row[1:])) for row in rows]
    # What is wider than the page is scrolled, also with the keyboard.
    return element("div", element("table", caption, top, element("tbody", *body), class_=class_), class_="scroll",
                   tabindex="0", role="group", aria_label=caption_text(caption, head))


def caption_text(caption, head):
    return html.unescape(caption.removeprefix("<caption>").removesuffix("</caption>")) if caption else f"table by {head[0]}"


def section(key, title, *children):
    """Nothing where there is nothing to show."""
    children = [child for child in children if child]
    if not children:
        return Markup("")
    return element("section", element("h2", title, id=f"{key}-title"), *children, id=key, aria_labelledby=f"{key}-title")


def some_of(items, most):
    """At most so many, evenly spread from the first to the last."""
    count = len(items)
    return items if count <= most else [items[i * (count - 1) // max(1, most - 1)] for i in range(most)]


def number(value, digits=4):
    """A number for people, with a dash for unknown ones."""
    if value is None or value != value:
        return "–"
    return f"{value:.{digits}g}".replace("-", "−")


def seconds(value):
    if value is None or value != value:
        return "–"
    if value < 120:
        return f"{value:.3g} s"
    return f"{value / 60:.3g} min" if value < 7200 else f"{value / 3600:.3g} h"
