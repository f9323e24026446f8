"""The page of one run, put together."""

import importlib.resources

from isochron.errors import InputError
from isochron.report.capture import capture_section
from isochron.report.geometry import geometry_section
from isochron.report.images import derivatives_section, images_section
from isochron.report.markup import Markup, element, section
from isochron.report.results import convergence_section, ending, headline, parameters_section
from isochron.report.settings import asked_section, cost_section, in_short
from isochron.report.surface import found_surface, surface_section


def resource(name):
    return Markup((importlib.resources.files("isochron.report") / name).read_text(encoding="utf-8"))


TITLES = {"asked": "The experiment", "ended": "How it ended", "stands": "So far", "surface": "The surface", "parameters": "Parameters",
          "convergence": "Convergence", "capture": "The capture", "images": "Images", "geometry": "Geometry",
          "derivatives": "Derivatives", "cost": "Cost and versions", "results": "Results",
          "differences": "Settings that differ", "curves": "Curves"}


# Nothing is loaded from anywhere.
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def document(title, header, sections):
    """The whole file; `sections` is key to markup, and empty ones are left out."""
    sections = {key: markup for key, markup in sections.items() if markup}
    links = [element("li", element("a", TITLES[key], href=f"#{key}")) for key in sections]
    head = element("head", element("meta", charset="utf-8"),
                   element("meta", name="viewport", content="width=device-width, initial-scale=1"),
                   element("meta", name="color-scheme", content="light dark"),
                   element("meta", http_equiv="Content-Security-Policy", content=POLICY), element("title", title),
                   element("link", rel="icon", href="data:,"), element("style", resource("page.css")))
    body = element("body", element("a", "To the content", href="#content", class_="skip"), header,
                   element("nav", element("ul", *links), aria_label="Sections"),
                   element("main", *sections.values(), id="content"), element("script", resource("page.js")))
    return Markup("<!DOCTYPE html>\n" + element("html", head, body, lang="en") + "\n")


def attempt(run, build):
    """A section; nothing but a note where the run's files hold what it cannot deal with, so that the others still come."""
    try:
        return build(run)
    except (InputError, ArithmeticError, AttributeError, IndexError, KeyError, OSError, TypeError, ValueError) as error:
        run.note(f"{build.__name__.replace('_section', '')}: left out: {type(error).__name__}: {error}")
        return ""


def run_page(run):
    header = element("header", element("h1", run.name), element("p", f"isochron, run in {run.directory}", class_="quiet"),
                     element("p", in_short(run)))
    builders = [surface_section, parameters_section, convergence_section, capture_section, images_section, geometry_section,
                derivatives_section, asked_section, cost_section]
    if found_surface(run):  # what was asked for comes first
        builders.remove(geometry_section)
        builders.insert(1, geometry_section)
    if run.is_capture and "target" in run.images:
        builders.remove(images_section)  # of hundreds of bins; slices show them
    sections = {build.__name__.removesuffix("_section"): attempt(run, build) for build in builders}
    # Last, as it lists what could not be read.
    key = "ended" if run.ended or run.state == "interrupted" else "stands"
    return document(f"{run.name}: {run.state}", header,
                    {key: section(key, TITLES[key], ending(run), headline(run)), **sections})
