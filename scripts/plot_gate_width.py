#!/usr/bin/python3
"""Draws what isochron_gate_width wrote: variance x CPU time against gate width (cost), or the variance (growth).

usage: plot_gate_width.py CSV PNG
"""

import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

TITLES = {"image": "gated image", "derivative": "derivative"}
SCENES = {"cube": "glossy cube", "box": "diffuse box with shadows"}
STYLES = {"standard": "C3o-", "ellipsoidal, uncoupled": "C1s-", "ellipsoidal, coupled pairs": "C0D-",
          "ellipsoidal, kept lengths": "C2^-"}
AUTOMATIC = {"automatic": "k.--"}


def draw_growth(rows):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.5), sharex=True, sharey=True, constrained_layout=True)
    figure.suptitle("Variance of the interior derivative per camera path, by gate width")
    for axis, (scene, title) in zip(axes, {"open": "without shadow edges", "shadow": "with shadow edges"}.items()):
        for method, style in STYLES.items():
            points = [(float(r["relative_width"]), float(r["variance"])) for r in rows
                      if (r["scene"], r["method"]) == (scene, method)]
            axis.loglog(*zip(*points), style, markersize=5, label=method)
            # The predicted law, through the point at 1 % of the path length.
            exponent = {"standard": -3, "ellipsoidal, uncoupled": -2,
                        "ellipsoidal, kept lengths": 0}.get(method, 0 if scene == "open" else -1)
            width, variance = min(points, key=lambda p: abs(p[0] - 0.01))
            axis.loglog([width, 1e-5], [variance, variance * (1e-5 / width) ** exponent], "k:", linewidth=1,
                        label="predicted exponents 0 or -1, -2, -3" if method == "standard" else None)
        axis.set_title(title)
        axis.set_xlabel("standard deviation of the gate over the path length")
        axis.grid(True, which="both", alpha=0.2)
    axes[0].set_ylabel("variance")
    axes[0].legend()
    return figure


def draw_cost(rows):
    figure, axes = plt.subplots(len(SCENES), len(TITLES), figsize=(11, 8), sharex=True, constrained_layout=True)
    figure.suptitle("What precision costs as gates get narrower (mean over pixels; derivative by a vertical motion)")
    for line, (scene, scene_title) in zip(axes, SCENES.items()):
        for axis, (quantity, title) in zip(line, TITLES.items()):
            for method, style in (STYLES | AUTOMATIC).items():
                points = [(100 * float(r["relative_width"]), float(r["variance_seconds"])) for r in rows
                          if (r["scene"], r["quantity"], r["method"]) == (scene, quantity, method)]
                # Without a derivative there is nothing to couple or to keep: one line for all ellipsoidal variants.
                if points and not (quantity == "image" and ("uncoupled" in method or "kept" in method)):
                    label = "ellipsoidal" if quantity == "image" and "pairs" in method else method
                    axis.loglog(*zip(*points), style, markersize=5, label=label)
            axis.set_title(f"{scene_title}: {title}")
            axis.set_ylabel("variance x CPU seconds")
            axis.grid(True, which="both", alpha=0.2)
            axis.legend()
    for axis in axes[-1]:
        axis.set_xlabel("standard deviation of the gate, % of the path length")
    return figure


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: plot_gate_width.py CSV PNG")
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    figure = draw_cost(rows) if "quantity" in rows[0] else draw_growth(rows)
    figure.savefig(sys.argv[2], dpi=90)


if __name__ == "__main__":
    main()
