#!/usr/bin/python3
"""Derivatives of direct light under gates down to Dirac, by a velocity of the emitter's point that keeps the path's length: a prototype
beside coupled pairs.

    scripts/length_keeping.py [SAMPLES]   a table in Markdown, 400 000 samples a row unless given; two minutes

A camera sees a diffuse floor that rises with theta, under a square lamp, half of it behind a small screen. From a point q of the floor,
seen through the pixel at distance r1, lamp points b of path length l lie on a circle about the foot of q: its radius is
sqrt(r2^2 - d^2), r2 = l - r1, d the lamp's height over q. In its angle phi, dA_b = r2 dphi dl, so that the gated radiance is

    L = integral W(l) integral over the visible phi of F r2 dphi dl,     F the contribution per area of floor and lamp.

If b keeps its angle and its length, theta changes F r2 (interior) and the ends of the visible arcs, at the lamp's border and at shadow
edges: W is never differentiated. Lengths come from W itself, and are all the same for a Dirac gate. Coupled pairs keep b where it is: the
change of length, D, is that of r1 + r2 for a fixed b, and W' is sampled by pairs of lengths on both sides of the gate's middle.
"""

import sys

import numpy as np

CAMERA = np.array([0.0, 1.5, 3.0])  # looks at the origin
ALBEDO = 0.7
LAMP_HEIGHT, LAMP = 2.0, ((-0.5, 0.5), (-0.5, 0.5))  # its sides in x and z; it looks down
SCREEN_HEIGHT, SCREEN = 1.0, ((0.1, 0.5), (-0.2, 0.2))
THETA = 0.1
PIXEL = (0.02, -0.01, 0.03)  # left, lower, width, where the distance to the image is one
LENGTH = 5.33  # of the gates' middle
WIDTHS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 0)  # standard deviation over the length; 0: Dirac
LARGEST = 0.001  # share of the samples


class Floor:
    """Points of the floor that pixels see, and how they move along the pixels' rays as the floor rises."""

    def __init__(self, u, v, theta):
        forward = -CAMERA / np.linalg.norm(CAMERA)
        right = np.cross(forward, [0, 1, 0])
        right /= np.linalg.norm(right)
        rays = forward + u[:, None] * right + v[:, None] * np.cross(right, forward)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        self.theta = theta
        self.r1 = (theta - CAMERA[1]) / rays[:, 1]
        self.r1_moves = 1 / rays[:, 1]
        self.q = CAMERA + self.r1[:, None] * rays
        self.q_moves = rays / rays[:, 1:2]


class Circle:
    """Lamp points of length l from the floor's; `lit`: whether there are any. Names that end in _moves are derivatives by theta."""

    def __init__(self, floor, length):
        self.floor = floor
        self.d = LAMP_HEIGHT - floor.theta
        r2 = length - floor.r1
        self.lit = r2 > self.d
        self.r2 = np.where(self.lit, r2, 2 * self.d)
        self.radius = np.sqrt(self.r2**2 - self.d**2)
        self.radius_moves = (self.d - self.r2 * floor.r1_moves) / self.radius
        # Cosines at both ends are d / r2.
        self.contribution = ALBEDO / np.pi * self.d**2 / self.r2**3
        self.contribution_moves = ALBEDO / np.pi * (3 * self.d**2 * floor.r1_moves / self.r2**4 - 2 * self.d / self.r2**3)
        # Of what the screen hides on the lamp's plane, seen from q.
        above = SCREEN_HEIGHT - floor.theta
        self.stretch, self.stretch_moves = self.d / above, (self.d - above) / above**2

    def edges(self):
        """(axis, place on the lamp's plane, its derivative) of the lines that bound what is visible."""
        for axis in (0, 1):
            q, q_moves = self.floor.q[:, 2 * axis], self.floor.q_moves[:, 2 * axis]
            for place in LAMP[axis]:
                yield axis, np.full_like(q, place), np.zeros_like(q)
            for place in SCREEN[axis]:
                yield axis, q + (place - q) * self.stretch, q_moves * (1 - self.stretch) + (place - q) * self.stretch_moves

    def visible(self, phi):
        """Of angles [sample] or [sample, number]."""
        wide = (slice(None), None) if phi.ndim == 2 else (slice(None),)
        inside = lambda x, sides: (x > sides[0]) & (x < sides[1])
        q = [self.floor.q[:, k][wide] for k in (0, 2)]
        b = [q[0] + self.radius[wide] * np.cos(phi), q[1] + self.radius[wide] * np.sin(phi)]
        hidden = [inside(q[k] + (b[k] - q[k]) / self.stretch, SCREEN[k]) for k in (0, 1)]
        return inside(b[0], LAMP[0]) & inside(b[1], LAMP[1]) & ~(hidden[0] & hidden[1]) & self.lit[wide]

    def arcs(self):
        """The angle that is visible in all, and its derivative: by the ends of the arcs."""
        ends, moves = [np.zeros_like(self.radius)], [np.zeros_like(self.radius)]
        for axis, place, place_moves in self.edges():
            cosine = (place - self.floor.q[:, 2 * axis]) / self.radius  # of the angle to the axis
            hit = np.abs(cosine) < 1
            angle = np.arccos(np.clip(cosine, -1, 1))
            speed = place_moves - self.floor.q_moves[:, 2 * axis] - self.radius_moves * cosine
            for side in (1, -1):
                change = -side * speed / np.where(hit, self.radius * np.sin(angle), 1)
                ends.append(np.where(hit, np.mod(side * angle + (np.pi / 2 if axis else 0), 2 * np.pi), 0))
                moves.append(np.where(hit, change, 0))
        ends, moves = np.stack([*ends, 2 * np.pi + ends[0]], axis=1), np.stack([*moves, moves[0]], axis=1)
        order = np.argsort(ends, axis=1)
        ends, moves = np.take_along_axis(ends, order, 1), np.take_along_axis(moves, order, 1)
        visible = self.visible(0.5 * (ends[:, 1:] + ends[:, :-1]))
        return (np.diff(ends, axis=1) * visible).sum(axis=1), (np.diff(moves, axis=1) * visible).sum(axis=1)

    def change_of_length(self, phi):
        """D of a lamp point that stays where it is."""
        b = np.stack([self.radius * np.cos(phi), np.full_like(phi, self.d), self.radius * np.sin(phi)], axis=1) / self.r2[:, None]
        return self.floor.r1_moves - (self.floor.q_moves * b).sum(axis=1)


def radiance(u, v, theta, length):
    circle = Circle(Floor(u, v, theta), length)
    return circle.contribution * circle.arcs()[0]


def derivative(u, v, theta, length):
    """That of the above by theta, in two parts: the interior, and the ends of arcs."""
    circle = Circle(Floor(u, v, theta), length)
    visible, ends = circle.arcs()
    return circle.contribution_moves * visible, circle.contribution * ends


def pair(u, v, sigma, generator):
    """Samples of the integral of W' D F by two lengths on both sides, at one angle."""
    floor, phi = Floor(u, v, THETA), 2 * np.pi * generator.random(len(u))
    away = sigma * np.sqrt(-2 * np.log1p(-generator.random(len(u))))
    sides = [Circle(floor, LENGTH + side * away) for side in (-1, 1)]
    before, after = (2 * np.pi * c.visible(phi) * c.contribution * c.change_of_length(phi) for c in sides)
    return (before - after) / (sigma * np.sqrt(2 * np.pi))


def interior(u, v, length, generator):
    """Samples of the first part of `derivative` by one angle, as a renderer would take them."""
    circle, phi = Circle(Floor(u, v, THETA), length), 2 * np.pi * generator.random(len(u))
    return 2 * np.pi * circle.visible(phi) * circle.contribution_moves


def largest(values):
    """The share of the sum of squares that the largest values have."""
    squares = np.sort(values**2)[::-1]
    return squares[: round(LARGEST * len(squares))].sum() / squares.sum()


def main():
    samples = int(sys.argv[1]) if len(sys.argv) > 1 else 400_000
    generator = np.random.default_rng(3)
    print("| width of the gate | derivative | interior, kept length | ends of arcs | coupled pairs | largest 0.1 % |\n"
          "|---|---|---|---|---|---|")
    for width in WIDTHS:
        u, v = PIXEL[0] + PIXEL[2] * generator.random(samples), PIXEL[1] + PIXEL[2] * generator.random(samples)
        lengths = LENGTH * (1 + width * generator.normal(size=samples))
        inner, ends = derivative(u, v, THETA, lengths)
        mean = (inner + ends).mean()
        over = lambda values: f"{np.std(values) / abs(mean):.2g}"
        pairs = pair(u, v, width * LENGTH, generator) if width else None
        cells = [f"{100 * width:g} %" if width else "Dirac", f"{mean:.3g} +- {np.std(inner + ends) / np.sqrt(samples):.1g}",
                 over(interior(u, v, lengths, generator)), over(ends), *((over(pairs), f"{100 * largest(pairs):.0f} %") if width else ("", ""))]
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
