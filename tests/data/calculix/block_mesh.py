"""Hexahedra of 20 nodes for a quarter of a block of tissue whose lump they follow.

Lengths in mm; x and y from the block's middle, z down from its surface. Around a ball or an ellipsoid lies an O-grid:
a rounded cube in its core, shells from there to the lump's surface and from the surface to a box, and bricks from the
box to the block's sides. An upright cylinder has the same in the plane, drawn along z. Bricks become smaller towards
the rim of the floor, where a bonded, nearly incompressible block has a singular edge.
"""

import numpy as np

SHAPES = ("none", "sphere", "ellipsoid", "cylinder")
RIM = 0.2  # cells at the rim over the largest ones
CORE = 0.55  # of the lump's half sizes: the core's
BULGE = 0.5  # how far the core's faces follow the lump's: 0, flat, to 1

# Corners, then the middles of edges as CalculiX counts them; on a lattice of three points a side.
NODES20 = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
           (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
           (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
# The corners of the six faces.
FACES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def size_mm(shape, d_mm):
    """Outer sizes along x, y, z of a lump as palpate's data sets have it."""
    return np.array([1.5 * d_mm if shape == "ellipsoid" else d_mm, d_mm, d_mm])


def spaced(first, last, first_size, last_size, largest, growth=0.6, even=False):
    """Places from first to last: cells of about these sizes at both ends that grow with the way from there."""
    at = np.linspace(first, last, 2001)
    size = np.minimum(np.minimum(first_size + growth * (at - first), last_size + growth * (last - at)), largest)
    cells = np.concatenate([[0], np.cumsum(2 / (size[1:] + size[:-1]))]) * (at[1] - at[0])
    count = max(2, 2 * round(cells[-1] / 2) if even else round(cells[-1]))
    return np.interp(np.arange(count + 1) / count * cells[-1], cells, at)


def rounded(q):
    """A point of the cube from -1 to 1 on its way to the ball: its faces to the ball's surface."""
    a, b, c = q[..., 0] ** 2, q[..., 1] ** 2, q[..., 2] ** 2
    return np.stack([q[..., 0] * np.sqrt(1 - b / 2 - c / 2 + b * c / 3),
                     q[..., 1] * np.sqrt(1 - a / 2 - c / 2 + a * c / 3),
                     q[..., 2] * np.sqrt(1 - a / 2 - b / 2 + a * b / 3)], axis=-1)


def disc(q):
    """The same of a square and a disc, in the plane."""
    return np.stack([q[..., 0] * np.sqrt(1 - q[..., 1] ** 2 / 2), q[..., 1] * np.sqrt(1 - q[..., 0] ** 2 / 2),
                     q[..., 2]], axis=-1)


def with_middles(lines):
    """The lines and the middles between them: where nodes of 20-node bricks lie."""
    out = np.empty(2 * len(lines) - 1)
    out[::2] = lines
    out[1::2] = (np.asarray(lines[1:]) + lines[:-1]) / 2
    return out


class Mesh:
    """Nodes (n x 3), elements (20 nodes each) and which of them are the lump's."""

    def __init__(self):
        self._points, self._cells, self._lump, self._count = [], [], [], 0

    def add(self, lattice, lump):
        """Cells of a lattice of places, (2 nx + 1) x (2 ny + 1) x (2 nz + 1) x 3."""
        at = self._count + np.arange(lattice[..., 0].size).reshape(lattice.shape[:3])
        nx, ny, nz = ((n - 1) // 2 for n in lattice.shape[:3])
        cells = np.stack([at[a:a + 2 * nx - 1:2, b:b + 2 * ny - 1:2, c:c + 2 * nz - 1:2] for a, b, c in NODES20], -1)
        cells = cells.reshape(-1, 20)
        self._points.append(lattice.reshape(-1, 3))
        self._cells.append(cells)
        self._lump.append(np.full(len(cells), lump))
        self._count += lattice[..., 0].size

    def close(self):
        """Joins nodes at the same place, turns cells that are inside out, and drops nodes that no cell has."""
        points, cells = np.concatenate(self._points), np.concatenate(self._cells)
        self.lump = np.concatenate(self._lump)
        keys = np.round((points + np.array([1.2345, 0.98765, 0.4567]) * 1e-5 / np.pi) * 1e4).astype(np.int64)
        _, first, same = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        cells = same.reshape(-1)[cells]
        used, cells = np.unique(cells, return_inverse=True)
        self.nodes, self.cells = points[first][used], cells.reshape(-1, 20)
        corner = self.nodes[self.cells]
        along = [corner[:, n] - corner[:, 0] for n in (1, 3, 4)]
        turned = np.einsum("ij,ij->i", np.cross(along[0], along[1]), along[2]) < 0
        mirror = [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19]
        self.cells[turned] = self.cells[turned][:, mirror]
        return self

    def outer_faces(self):
        """Corners of the faces that one cell alone has."""
        faces = np.concatenate([self.cells[:, list(face)] for face in FACES])
        _, at, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return faces[at[count == 1]]


def grid(x, y, z):
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)


def add_bricks(mesh, lines, hole):
    """Bricks between three sets of lines but for those in the hole, of which each side is a line's place."""
    parts = []
    for c in range(3):
        edges = [np.flatnonzero(np.isclose(lines[c], h))[0] for h in hole[c]]
        cuts = sorted({0, *edges, len(lines[c]) - 1})
        parts.append([(a, b, a >= edges[0] and b <= edges[1]) for a, b in zip(cuts, cuts[1:])])
    for x in parts[0]:
        for y in parts[1]:
            for z in parts[2]:
                if not (x[2] and y[2] and z[2]):
                    mesh.add(grid(*(with_middles(lines[c][p[0]:p[1] + 1]) for c, p in enumerate((x, y, z)))), False)


def outward(first, last, size, m):
    """From a box around the lump to the block's side or floor, where the rim is."""
    largest = 10 / m
    return spaced(first, last, size, RIM * largest, largest)


def ball_mesh(half_mm, thickness_mm, half_sizes, depth_mm, m):
    """A quarter with a ball or an ellipsoid; m cells along a half of the core."""
    centre = np.array([0, 0, depth_mm + half_sizes[2]])
    gap = 0.5 * min(half_sizes[1], depth_mm)  # from the lump to the box, above it
    top = depth_mm - gap
    bottom = min(2 * centre[2] - top, (centre[2] + half_sizes[2] + thickness_mm) / 2)
    middle = (top + bottom) / 2
    box = [(0, half_sizes[0] + 1.2 * gap), (0, half_sizes[1] + 1.2 * gap), (top, bottom)]
    mesh = Mesh()
    lines = [np.concatenate([np.linspace(0, box[c][1], m + 1)[:-1],
                             outward(box[c][1], half_mm, box[c][1] / m, m)]) for c in range(2)]
    step = (bottom - top) / (2 * m)
    lines.append(np.concatenate([spaced(0, top, step, step, step)[:-1], np.linspace(top, bottom, 2 * m + 1)[:-1],
                                 outward(bottom, thickness_mm, step, m)]))
    add_bricks(mesh, lines, box)

    def core(q):
        return centre + CORE * half_sizes * ((1 - BULGE) * q / 1.25 + BULGE * rounded(q))

    def surface(q):
        return centre + half_sizes * rounded(q)

    def wall(q):
        z = middle + (bottom - top) / 2 * q[..., 2]
        return np.stack([box[0][1] * q[..., 0], box[1][1] * q[..., 1], z], axis=-1)

    side, whole = np.linspace(0, 1, 2 * m + 1), np.linspace(-1, 1, 4 * m + 1)
    mesh.add(core(grid(side, side, whole)), True)
    faces = [grid([1.0], side, whole), grid(side, [1.0], whole), grid(side, side, [1.0]), grid(side, side, [-1.0])]
    for face in faces:
        axis = face.shape.index(1)
        for begin, end, lump in ((core, surface, True), (surface, wall, False)):
            layers = [begin(face) * (1 - t) + end(face) * t for t in np.linspace(0, 1, 2 * m + 1)]
            mesh.add(np.concatenate(layers, axis=axis), lump)
    return mesh.close()


def cylinder_mesh(half_mm, thickness_mm, half_sizes, depth_mm, m):
    """A quarter with an upright cylinder: the same O-grid in every plane."""
    gap = 0.5 * half_sizes[0]
    box = half_sizes[0] + gap
    low, high = depth_mm, depth_mm + 2 * half_sizes[2]
    plane = np.concatenate([np.linspace(0, box, m + 1)[:-1], outward(box, half_mm, box / m, m)])
    step = box / m
    z = np.concatenate([spaced(0, low, step, step / 2, step)[:-1],
                        spaced(low, high, step / 2, step / 2, step, even=True)[:-1],
                        outward(high, thickness_mm, step / 2, m)])
    within = (z[:-1] >= low - 1e-9) & (z[1:] <= high + 1e-9)
    mesh = Mesh()

    def add(points, lump):
        """Points in the plane, n x m x 1 x 3, drawn along z."""
        for k in range(len(z) - 1):
            layers = [np.concatenate([points[..., :2], np.full_like(points[..., 2:], h)], axis=-1)
                      for h in (z[k], (z[k] + z[k + 1]) / 2, z[k + 1])]
            mesh.add(np.concatenate(layers, axis=2), lump and bool(within[k]))

    def core(q):
        return CORE * half_sizes * ((1 - BULGE) * q / 1.15 + BULGE * disc(q))

    def surface(q):
        return half_sizes * disc(q)

    def wall(q):
        return box * q

    side, flat = np.linspace(0, 1, 2 * m + 1), np.zeros(1)
    outer, inner = with_middles(plane[m:]), with_middles(plane[:m + 1])
    for x, y in ((outer, inner), (inner, outer), (outer, outer)):
        add(grid(x, y, flat), False)
    add(core(grid(side, side, flat)), True)
    for face in (grid([1.0], side, flat), grid(side, [1.0], flat)):
        axis = face.shape.index(1)
        for begin, end, lump in ((core, surface, True), (surface, wall, False)):
            layers = [begin(face) * (1 - t) + end(face) * t for t in np.linspace(0, 1, 2 * m + 1)]
            add(np.concatenate(layers, axis=axis), lump)
    return mesh.close()


def plain_mesh(half_mm, thickness_mm, m):
    """A quarter of tissue alone."""
    lines = [with_middles(outward(0, length, 10 / m, m)) for length in (half_mm, half_mm, thickness_mm)]
    mesh = Mesh()
    mesh.add(grid(*lines), False)
    return mesh.close()


def mesh_of(case, m):
    """The mesh of a case (see press_block.py). Throws ValueError where cells leave a gap or are inside out."""
    half, thickness = case["side_mm"] / 2, case["thickness_mm"]
    if case["shape"] == "none":
        mesh = plain_mesh(half, thickness, m)
    else:
        build = cylinder_mesh if case["shape"] == "cylinder" else ball_mesh
        mesh = build(half, thickness, size_mm(case["shape"], case["d_mm"]) / 2, case["depth_mm"], m)
    faces = mesh.nodes[mesh.outer_faces()]
    on_wall = [np.all(np.abs(faces[:, :, c] - at) < 1e-6, axis=1) for c, walls in
               enumerate(((0, half), (0, half), (0, thickness))) for at in walls]
    if not np.all(np.any(on_wall, axis=0)):
        raise ValueError(f"{np.count_nonzero(~np.any(on_wall, axis=0))} faces inside the block have one cell alone")
    return mesh
