#!/usr/bin/python3
"""Draws variance x CPU time against gate width from the CSV of isochron_gate_width.

usage: plot_gate_width.py CSV PNG
"""

import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

TITLES = {"image": "gated image", "interior": "interior derivative"}
SCENES = {"cube": "glossy cube", "box": "diffuse box with shadows"}
STYLES = {"standard": "C3o-", "ellipsoidal, uncoupled": "C1s-", "ellipsoidal, coupled pairs": "C0D-"}


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: plot_gate_width.py CSV PNG")
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    figure, axes = plt.subplots(len(SCENES), len(TITLES), figsize=(11, 8), sharex=True, constrained_layout=True)
    figure.suptitle("What precision costs as gates get narrower (mean over the image; derivative by a vertical motion)")
    for line, (scene, scene_title) in zip(axes, SCENES.items()):
        for axis, (quantity, title) in zip(line, TITLES.items()):
            for method, style in STYLES.items():
                points = [(100 * float(r["relative_width"]), float(r["variance_seconds"])) for r in rows
                          if (r["scene"], r["quantity"], r["method"]) == (scene, quantity, method)]
                # Without a derivative there is nothing to couple: one line for both ellipsoidal variants.
                if points and not (quantity == "image" and method == "ellipsoidal, uncoupled"):
                    label = "ellipsoidal" if quantity == "image" and method != "standard" else method
                    axis.loglog(*zip(*points), style, markersize=5, label=label)
            axis.set_title(f"{scene_title}: {title}")
            axis.set_ylabel("variance x CPU seconds")
            axis.grid(True, which="both", alpha=0.2)
            axis.legend()
    for axis in axes[-1]:
        axis.set_xlabel("standard deviation of the gate, % of the path length")
    figure.savefig(sys.argv[2], dpi=90)


if __name__ == "__main__":
    main()
