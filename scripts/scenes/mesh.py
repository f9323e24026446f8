"""Triangle meshes for the scenes of this repository: small solids, transforms and an OBJ writer.

A mesh is a pair (vertices: float array n x 3, triangles: int array m x 3); triangles are counter-clockwise
seen from the side that the normal points to. y is up.
"""

import numpy as np


def quad(corners):
    """A rectangle from its four corners, counter-clockwise seen from the normal's side."""
    return np.asarray(corners, dtype=float), np.array([[0, 1, 2], [0, 2, 3]])


def box(size):
    """An axis-aligned box around the origin, normals outwards; size: the edges' lengths, one or three."""
    half = 0.5 * np.broadcast_to(np.asarray(size, dtype=float), 3)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return corners * half, np.array(triangles)


def square(edge):
    """A square around the origin in the plane z = 0, facing +z."""
    h = 0.5 * edge
    return quad([(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)])


def face_towards(mesh, position, target):
    """The mesh moved from the origin to `position` and turned so that its z axis points at `target`."""
    vertices, triangles = mesh
    z = np.asarray(target, dtype=float) - position
    z /= np.linalg.norm(z)
    x = np.cross((0, 1, 0) if abs(z[1]) < 0.9 else (1, 0, 0), z)
    x /= np.linalg.norm(x)
    return rounded((vertices @ np.stack([x, np.cross(z, x), z]) + np.asarray(position), triangles))


def grid(rows, columns):
    """Triangles between rows x columns vertices that are listed row by row, facing (down a column) x (along a row)."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below, right = corner + columns, corner + 1
    return np.concatenate([np.stack([corner, below, right], 1), np.stack([right, below, below + 1], 1)])


def translate(mesh, offset):
    vertices, triangles = mesh
    return vertices + np.asarray(offset, dtype=float), triangles


def rotate_y(mesh, degrees):
    """Turned about the vertical through the origin, by the right-hand rule."""
    vertices, triangles = mesh
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return vertices @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T, triangles


def rotate_z(mesh, degrees):
    """Turned about the z axis through the origin, by the right-hand rule: x towards y."""
    vertices, triangles = mesh
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return vertices @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T, triangles


def rounded(mesh):
    """Coordinates rounded to 1e-5: the last bits of another processor's arithmetic do not show."""
    vertices, triangles = mesh
    return np.round(vertices, 5), triangles


def prism(sides, rings):
    """A closed solid of revolution with few sides around the vertical. rings: (height, radius, x, z), upwards; x and
    z shift the ring's centre."""
    angles = 2 * np.pi * np.arange(sides) / sides
    circle = np.stack([np.cos(angles), np.zeros(sides), -np.sin(angles)], 1)
    vertices = np.concatenate([circle * r + (x, y, z) for y, r, x, z in rings])
    last = sides * (len(rings) - 1)
    triangles = [(0, i + 1, i) for i in range(1, sides - 1)] + [(last, last + i, last + i + 1) for i in range(1, sides - 1)]
    for start in range(0, last, sides):
        for i in range(sides):
            a, b = start + i, start + (i + 1) % sides
            triangles += [(a, b, b + sides), (a, b + sides, a + sides)]
    return vertices, np.array(triangles)


def icosphere():
    """A unit icosahedron with every face cut into four: 42 vertices, 80 triangles, outwards."""
    g = 0.5 * (1 + 5**0.5)
    corners = [(x, y, 0) for y in (-g, g) for x in (-1, 1)]
    vertices = np.array([np.roll(c, k) for k in range(3) for c in corners], dtype=float)
    near = lambda i, j: i != j and ((vertices[i] - vertices[j]) ** 2).sum() < 5  # edges have the length 2
    faces = [(i, j, k) for i in range(12) for j in range(i + 1, 12) for k in range(j + 1, 12)
             if near(i, j) and near(j, k) and near(i, k)]
    middles = {}

    def middle(i, j):
        return middles.setdefault((min(i, j), max(i, j)), 12 + len(middles))

    triangles = []
    for i, j, k in faces:
        if np.linalg.det(vertices[[i, j, k]]) < 0:
            j, k = k, j
        a, b, c = middle(i, j), middle(j, k), middle(k, i)
        triangles += [(i, a, c), (a, j, b), (c, b, k), (a, b, c)]
    vertices = np.concatenate([vertices] + [[vertices[i] + vertices[j]] for i, j in middles])
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), np.array(triangles)


def join(*meshes):
    """One mesh of several; vertices at the same position become one."""
    offsets = np.cumsum([0] + [len(v) for v, _ in meshes[:-1]])
    vertices = np.concatenate([v for v, _ in meshes])
    triangles = np.concatenate([t + o for (_, t), o in zip(meshes, offsets)])
    index, kept = {}, []
    renumbered = np.empty(len(vertices), dtype=int)
    for i, vertex in enumerate(map(tuple, vertices)):
        if vertex not in index:
            index[vertex] = len(kept)
            kept.append(vertex)
        renumbered[i] = index[vertex]
    return np.array(kept), renumbered[triangles]


def write_obj(path, mesh, comment):
    vertices, triangles = mesh
    lines = [f"# {comment}"]
    # Nine digits hold single precision, in which meshes are read. Adding zero turns -0 into 0.
    lines += ["v " + " ".join(f"{np.round(x, 9) + 0.0:.9g}" for x in v) for v in vertices]
    lines += ["f " + " ".join(str(i + 1) for i in t) for t in triangles]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
