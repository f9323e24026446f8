#!/usr/bin/python3
"""What `isochron reconstruct` makes of the hidden rabbit where its model of the light is wrong: light that the rabbit scatters twice, a
glossy rabbit, time zero off by a bin, a response whose width is off by 20 %. 32 x 32 points, 2000 photons each. Writes
wrong_models.csv after every reconstruction:

    model                          what is wrong
    median_mm, within_80_mm        of the differences in depth, where surface and truth are seen
    bias_mm                        median of found - true
    silhouette                     intersection over union of what is seen
    deviance_over_floor, verdict   of the fit
    covered                        share of the true depths within three standard errors of the fit's
"""

import argparse
import sys

import numpy as np

import rabbit_capture
import rabbit_errors
from isochron.mesh_files import read_mesh
from reproduction.measure import program, summary
from reproduction.study import study
from reproduction.tables import markdown

COLUMNS = "model", "median_mm", "within_80_mm", "bias_mm", "silhouette", "deviance_over_floor", "verdict", "covered"
RESPONSE = rabbit_errors.SCENE / "response.csv"
BIN = 16  # picoseconds
POINTS, SEED = 32, 1
# How the counts are made, and by how much the response is stretched and moved that the reconstruction is told.
MODELS = {
    "as it should be": ((), 1, 0),
    "light scattered twice among the counts": (("--bounces", "2"), 1, 0),
    "glossy: plastic with a roughness of 0.3": (("--material", "{type: plastic, albedo: 0.75, roughness: 0.3}"), 1, 0),
    "time zero late by a bin": ((), 1, -BIN),
    "response told 20 % too wide": ((), 1.2, 0),
    "response told 20 % too narrow": ((), 0.8, 0),
}


def response(stretch, shift, path):
    """About the peak."""
    offsets, values = np.loadtxt(RESPONSE, delimiter=",", skiprows=1).T
    peak = offsets[values.argmax()]
    np.savetxt(path, np.stack([peak + stretch * (offsets - peak) + shift, values], axis=1), "%.9g", ",", header="offset,value", comments="")


def row(model, seconds, folder):
    how, stretch, shift = MODELS[model]
    path, told, run = folder / "capture.h5", folder / "response.csv", folder / "run"
    rabbit_capture.main([path, "--points", POINTS, "--seed", SEED, *how])
    response(stretch, shift, told)
    program("reconstruct", path, "-o", run, "--response", told, "--seconds", seconds, "--seed", SEED, "--force")
    surface, fit = run / "geometry/final_surface.ply", summary(run)["fit"]
    true = rabbit_errors.depths(*read_mesh(rabbit_errors.SCENE / "rabbit.obj"))
    found = rabbit_errors.compared(rabbit_errors.depths(*read_mesh(surface)), true)
    covered = rabbit_errors.covered(surface, true, rabbit_errors.LINES)
    return (model, *(f"{found[key]:.3g}" for key in COLUMNS[1:5]), f"{fit['deviance'] / fit['floor']:.4f}", fit["verdict"], f"{covered:.3f}")


def table_of(rows):
    """For experiments/README.md."""
    return markdown(["", "median / 80 % / bias, mm", "silhouette", "verdict", "within 3 errors"],
                    [[row["model"], f"{row['median_mm']} / {row['within_80_mm']} / {float(row['bias_mm']):+.2g}", row["silhouette"],
                      row["verdict"], f"{100 * float(row['covered']):.0f} %"] for row in rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=100, help="of each reconstruction (default 100)")
    return study(parser, "wrong_models.csv", COLUMNS, lambda options, folder: ([row(model, options.seconds, folder)] for model in MODELS), table_of)


if __name__ == "__main__":
    sys.exit(main())
