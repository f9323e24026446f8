"""What a reconstruction found: its picture as seen from the wall, and the colours of its meshes in the view that turns."""

import functools

from isochron.report.markup import Markup, element, join, section
from isochron.report.png import Scale, figure_uri


@functools.lru_cache(maxsize=1)
def found_surface(run):
    """None of a run that is no reconstruction, or whose files cannot be read, which a note says."""
    if not (run.top / "back_projection.ply").exists():
        return None
    # Imported here, as h5py and SciPy take longer to load than most pages to be written.
    from isochron.pictures.found_surface import FoundSurface

    return run.read(lambda path: FoundSurface(run.top), run.top.absolute() / "back_projection.ply")


def surface_section(run):
    found = found_surface(run)
    if not found:
        return Markup("")
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from isochron.pictures.surface_sheet import surface_figure

    figure = surface_figure(found)
    uri = figure_uri(figure)
    plt.close(figure)
    of_fit = f"depth, albedo{' and standard error' if found.fit.errors is not None else ''} of the surface, and " if found.fit else ""
    words = f"Seen from the wall: {of_fit}depth and albedo by back-projection, the start of the fit."
    picture = element("figure", element("img", src=uri, alt=words, class_="paper"), element("figcaption", words), class_="card wide")
    return section("surface", "The surface", picture)


def colours_of(found, surface):
    """Layer -> colours of the vertices [N, 3], 0 to 255; layer -> its scale."""
    from isochron.pictures.scene_views import scale_of_albedo
    from isochron.pictures.surface_sheet import ALBEDO, ERROR, end_of_errors, shades

    layers, bars = {}, {}
    undetermined = None if surface.errors is None else found.undetermined(surface.errors)

    def add(layer, values, colours, end, label):
        layers[layer] = 255 * shades(values, colours, 0, end, undetermined)[:, :3]
        bars[layer] = Scale(colours, 0, end).bar(label)

    if surface.albedo is not None:
        add("albedo", surface.albedo, ALBEDO, scale_of_albedo([surface.albedo])[1], f"albedo, relative: {surface.name}")
    if surface.errors is not None:
        end = end_of_errors(found, 1000 * surface.errors[~undetermined])
        add("uncertainty", 1000 * surface.errors, ERROR, end,
            "standard error along the normal (mm), pale where the data do not determine the surface")
    return layers, bars


def layer_switch(bars):
    """Buttons for what the view's colours mean, and the scales of it; nothing where shapes have no colours of their own."""
    if not bars:
        return None
    labels = [element("label", element("input", type="radio", name="layer", value=layer, checked=layer == "albedo"), f" {layer}")
              for layer in ("shape", *bars)]
    scales = [element("div", *lines, data_layer=layer, hidden=layer != "albedo") for layer, lines in bars.items()]
    switch = element("div", element("span", "Colour:"), *labels, class_="controls", role="radiogroup", aria_label="Colour of the surfaces")
    return join([switch, *scales])
