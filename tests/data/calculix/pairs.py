#!/usr/bin/python3
"""Presses the lumps of palpate's data sets by CalculiX and writes copies of the sets with its maps and forces, so that
`palpate-lab evaluate` judges by another program.

    pairs.py FIRST.h5 SAME.h5 GROWN.h5 --out FOLDER [--cells 2,3] [--work FOLDER] [--jobs 1]

The sets are those of `palpate-lab dataset` with lumps in the middle and --shapes sphere,ellipsoid,cylinder. Lumps that
sets share are pressed once, to the greatest press of all. What ccx answered is kept in the work folder and not asked
again; tissue alone is pressed at three thicknesses, for the error that the rim of the floor makes.
"""

import argparse
import concurrent.futures
import json
import math
import pathlib
import shutil
import tempfile

import h5py
import numpy as np

import press_block
from block_mesh import mesh_of
from press_block import NODES, PITCH_MM, read_dat, run_ccx, shapes8, top_faces

SHAPES = ("sphere", "ellipsoid", "cylinder")
STEP_MM, LEAST_STEPS = 0.6, 6
PLAIN_CELLS, PLAIN_MM = (2, 3, 4), (18.0, 21.0, 24.0)
PLAIN_STEPS, FINEST_STEPS = 10, 7  # the finest mesh's cells at the rim do not bear the deepest presses
DEGREE = 5  # of pressure over press, over the steps
SPLINE_MM = 2.6  # of the smooth surface that a map is: about the size of the elements
PROGRAM = "CalculiX 2.20, C3D20R, *HYPERELASTIC, NEO HOOKE"


def steps_mm(greatest_mm):
    """Presses of a run, in even steps to the greatest that is wanted."""
    count = max(LEAST_STEPS, math.ceil(greatest_mm / STEP_MM))
    return [greatest_mm * (k + 1) / count for k in range(count)]


def run_of(case, m, work):
    """Places and reactions of the surface's nodes at each step, from the work folder or by ccx. The tissue's modulus
    is 1 N/mm2."""
    name = "_".join(f"{case[k]:.5g}" if k != "shape" else case[k]
                    for k in ("shape", "d_mm", "depth_mm", "ratio", "thickness_mm") if k in case) + f"_{m}"
    kept = work / f"{name}.npz"
    loads = case["press_mm"]
    if kept.exists() and np.allclose(np.load(kept)["press_mm"], loads):
        return np.load(kept)
    folder = work / name
    folder.mkdir(parents=True, exist_ok=True)
    mesh = mesh_of(case, m)
    try:
        wall_s = run_ccx(folder, press_block.deck(case, mesh, loads))
    except RuntimeError as error:  # deep presses fold the smallest cells at the rim
        np.savez(kept, press_mm=loads, force=[])
        print(f"{name}: {str(error)[-200:]}", flush=True)
        return np.load(kept)
    tables = read_dat(folder / "block.dat")
    moved = [t[2:] for t in tables if t[0] == "displacements" and t[1] == "TOP"]
    forces = [t[2:] for t in tables if t[0] == "forces" and t[1] == "TOP"]
    top = moved[0][0]
    if len(moved) != len(loads) or not all(np.allclose(u[:, 2], way, atol=1e-5) for way, (_, u) in zip(loads, moved)):
        raise RuntimeError("ccx wrote other loads than were asked for")
    np.savez(kept, press_mm=loads, faces=top_faces(mesh, top), at=[(mesh.nodes[top] + u)[:, :2] for _, u in moved],
             force=[f[:, 2] for _, f in forces])
    (folder / "block.dat").unlink()
    print(f"{name}: {len(mesh.nodes)} nodes, {wall_s:.0f} s", flush=True)
    return np.load(kept)


def surface_pressure(faces, at, force):
    """At the surface's nodes: the field whose work on the elements' own shapes is the reactions'."""
    g, w = np.sqrt(0.6) * np.array([-1, 0, 1]), np.array([5, 8, 5]) / 9
    a, b = (v.reshape(-1) for v in np.meshgrid(g, g))
    n, da, db = shapes8(a, b)
    local = np.einsum("pf,pi,pj->fij", areas(faces, at, da, db) * np.outer(w, w).reshape(-1, 1), n, n)
    mass = np.zeros((len(at), len(at)))
    np.add.at(mass, (faces[:, :, None], faces[:, None, :]), local)
    return np.linalg.solve(mass, force)


def areas(faces, at, da, db):
    xa, ya, xb, yb = da @ at[faces, 0].T, da @ at[faces, 1].T, db @ at[faces, 0].T, db @ at[faces, 1].T
    return np.abs(xa * yb - ya * xb)  # places x faces


def splines(x, y, count):
    """Products of cubic B-splines SPLINE_MM apart, even about the planes of symmetry: places x (count^2)."""
    def line(at):
        u = np.abs(at[:, None] / SPLINE_MM + np.array([[[1]], [[-1]]]) * np.arange(count))
        value = np.where(u < 1, (4 - 6 * u ** 2 + 3 * u ** 3) / 6, np.where(u < 2, (2 - u) ** 3 / 6, 0))
        value[0, :, 0] = 0  # its own mirror image
        return value.sum(axis=0)
    return (line(x)[:, :, None] * line(y)[:, None, :]).reshape(len(x), -1)


def quarter_map(faces, at, force):
    """The pressure at a quarter of the map's nodes: a smooth surface through the elements' own field, which from
    element to element swings by some per cent where these are as large as the bump is narrow."""
    g = np.array([0.8611363116, 0.3399810436])
    g, w = np.concatenate([-g, g[::-1]]), np.array([0.3478548451, 0.6521451549, 0.6521451549, 0.3478548451])
    a, b = (v.reshape(-1) for v in np.meshgrid(g, g))
    n, da, db = shapes8(a, b)
    weight = (areas(faces, at, da, db) * np.outer(w, w).reshape(-1, 1)).reshape(-1)
    count = int(np.ceil(at.max() / SPLINE_MM)) + 2
    base = splines((n @ at[faces, 0].T).reshape(-1), (n @ at[faces, 1].T).reshape(-1), count)
    field = (n @ surface_pressure(faces, at, force)[faces].T).reshape(-1)
    normal = base.T @ (weight[:, None] * base)
    normal += 1e-7 * np.trace(normal) / len(normal) * np.eye(len(normal))  # those that reach in by a corner alone
    line = np.arange(NODES // 2 + 1) * PITCH_MM
    x, y = (v.reshape(-1) for v in np.meshgrid(line, line))
    return splines(x, y, count) @ np.linalg.solve(normal, base.T @ (weight * field))


def rows_of(run):
    """Force and quarter map in one row for each step."""
    return np.array([[4 * f.sum(), *quarter_map(run["faces"], a, f)] for a, f in zip(run["at"], run["force"])])


def rim_mm(case, m):
    """The cells' size at the rim of the floor, which rounding makes unlike from mesh to mesh."""
    nodes, half = mesh_of(case, m).nodes, case["side_mm"] / 2
    on_top = np.unique(nodes[(abs(nodes[:, 2]) < 1e-6) & (abs(nodes[:, 1] - half) < 1e-6), 0].round(6))
    on_edge = np.unique(nodes[(abs(nodes[:, 0] - half) < 1e-6) & (abs(nodes[:, 1] - half) < 1e-6), 2].round(6))
    return math.sqrt((on_top[-1] - on_top[-3]) * (on_edge[-1] - on_edge[-3]))


def order_of(sizes, forces):
    """The power of the cells' size with which forces converge: one for all thicknesses, rows of three meshes each."""
    def left(order):
        total = 0
        for size, force in zip(sizes, forces):
            part = np.stack([np.ones(3), size ** order], axis=1)
            total += np.linalg.lstsq(part, force / force[0], rcond=None)[1].sum()
        return total
    orders = np.linspace(0.3, 2, 171)
    return orders[np.argmin([left(order) for order in orders])]


class Rim:
    """What a mesh's force is off by, over the press's share of the thickness, and the pressure of each N of it."""

    def __init__(self, cases, plain):
        """`plain`: for each of PLAIN_MM its runs on PLAIN_CELLS, all with the same shares, the finest to fewer."""
        share = plain[0][0]["press_mm"] / PLAIN_MM[0]
        sizes = np.array([[rim_mm(case, m) for m in PLAIN_CELLS] for case in cases])
        rows = [[rows_of(run) for run in runs] for runs in plain]
        known = FINEST_STEPS
        order = [order_of(sizes, np.array([[r[k, 0] for r in of] for of in rows])) for k in range(known)]
        self.order = np.polyfit(share[:known], order, 1)  # straight on to the deepest presses
        p = np.polyval(self.order, share)
        self.curves, self.pressure_per_N = [], []
        for size, (coarse, middle, _) in zip(sizes, rows):
            apart = coarse - middle
            self.curves.append(np.polyfit(share, apart[:, 0] / (size[0] ** p - size[1] ** p) / share, 3))
            over = apart[:, 1:].reshape(-1, NODES // 2 + 1, NODES // 2 + 1)[:, :-4, :-4].mean(axis=(1, 2))
            self.pressure_per_N.append(np.polyfit(share, over / apart[:, 0], 2))
        print(f"rim of tissue alone: order {p[0]:.2f} to {p[-1]:.2f} ({order})")

    @staticmethod
    def between(thickness_mm, values):
        """Of what is known at PLAIN_MM: the parabola through it."""
        return sum(v * np.prod([(thickness_mm - b) / (a - b) for b in PLAIN_MM if b != a])
                   for a, v in zip(PLAIN_MM, values))

    def of(self, size_mm, thickness_mm, share):
        """Error of force, and of pressure over the map, at shares of the thickness. `size_mm`: of the cells."""
        scale = self.between(thickness_mm, [share * np.polyval(c, share) for c in self.curves])
        force = scale * size_mm ** np.polyval(self.order, share)
        return force, force * self.between(thickness_mm, [np.polyval(c, share) for c in self.pressure_per_N])


def corrected(case, m, run, rim):
    """Force and quarter map at each step, without the rim's error."""
    rows = rows_of(run)
    force, pressure = rim.of(rim_mm(case, m), case["thickness_mm"], run["press_mm"] / case["thickness_mm"])
    rows[:, 0] -= force
    rows[:, 1:] -= pressure[:, None]
    return rows


def apart(rows, others):
    """At the deepest press: force over the other, and the map's difference, RMS over the peak, off the rim."""
    off = (others - rows)[-1, 1:].reshape(NODES // 2 + 1, -1)[:-3, :-3]
    return {"force_apart": round(float(others[-1, 0] / rows[-1, 0] - 1), 5),
            "map_apart_rms_over_peak": round(float(np.sqrt(np.mean(off ** 2)) / rows[-1, 1:].max()), 5)}


def finest_of(keys, cases, cells, runs, rim):
    """Presses and rows of one lump's days, by the finest mesh that bore all of them."""
    borne = [m for m in cells if all(len(runs[key, m]["force"]) for key in keys)]
    if not borne:
        raise SystemExit(f"no mesh bore the presses of {keys[0]}")
    pressed = {}
    for key in keys:
        case = cases[key]
        of = {m: corrected(case, m, runs[key, m], rim) for m in borne}
        pressed[key] = (np.array(case["press_mm"]), of[borne[-1]])
        told = {"cells": borne[-1]} | {f"cells_{m}": apart(of[borne[-1]], of[m]) for m in borne[:-1]}
        print(json.dumps({k: v for k, v in case.items() if k not in ("press_mm", "side_mm", "young_Pa")} | told))
    return pressed


def at_presses(ways_mm, rows, wanted_mm):
    """Rows at other presses than the steps: a polynomial of what each unit of the press makes."""
    x, wanted = ways_mm / ways_mm[-1], np.asarray(wanted_mm) / ways_mm[-1]
    fit = np.polynomial.polynomial.polyfit(x, rows / x[:, None], DEGREE)
    return wanted[:, None] * np.polynomial.polynomial.polyval(wanted, fit).T


def whole(quarter):
    rows = np.concatenate([quarter[:0:-1], quarter])
    return np.concatenate([rows[:, :0:-1], rows], axis=1)


def lump_cases(files):
    """Each file's cases, and the greatest press of each lump over all files."""
    days, greatest = [], {}
    for path in files:
        with h5py.File(path) as f:
            if np.any(f["shape"][:] >= len(SHAPES)) or np.any(f["shape"][:] < 0) or np.any(f["offset_mm"][:] != 0):
                raise SystemExit(f"{path}: wanted balls, ellipsoids and upright cylinders in the block's middle")
            day = []
            for i in range(len(f["number"])):
                key = (SHAPES[f["shape"][i]], f["diameter_mm"][i], f["depth_mm"][i], f["stiffness_ratio"][i],
                       f["thickness_mm"][i])
                greatest[key] = max(greatest.get(key, 0), f["press_mm"][i].max())
                day.append(key)
            days.append(day)
    return days, {key: {"side_mm": 40.0, "shape": key[0], "d_mm": key[1], "depth_mm": key[2], "ratio": key[3],
                        "thickness_mm": key[4], "young_Pa": 1e6, "press_mm": steps_mm(mm)}
                  for key, mm in greatest.items()}


def rounded(values):
    """Single precision of 13 bits, 0.006 %, which take half the room in a packed file."""
    bits = np.asarray(values, dtype=np.float32).view(np.uint32)
    return ((bits + (1 << 9)) & ~np.uint32((1 << 10) - 1)).view(np.float32)


def write_copy(source, target, keys, pressed):
    shutil.copyfile(source, target)
    with h5py.File(target, "r+") as f:
        # The reader finds the cases by the file's sweep, so that it stays.
        f.attrs["program"] = PROGRAM
        for i, key in enumerate(keys):
            ways_mm, rows = pressed[key]
            young, turned = f["young_Pa"][i], f["axis"][i] == 1
            for load, row in enumerate(at_presses(ways_mm, rows, f["press_mm"][i])):
                image = young * whole(row[1:].reshape(NODES // 2 + 1, -1))
                f["pressure_Pa"][i, load] = rounded(image.T if turned else image)
                f["force_N"][i, load] = 1e-6 * young * row[0]
            f["last_good_force_N"][i] = f["force_N"][i, -1]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+", type=pathlib.Path)
    parser.add_argument("--cells", default="2,3", help="meshes, see press_block.py: maps are the last one's that bears "
                        "the presses of all of a lump's days; how far the others lie from it is told")
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path(tempfile.gettempdir()) / "calculix")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--jobs", type=int, default=1, help="runs of ccx at once, one thread each")
    options = parser.parse_args()
    cells = [int(m) for m in options.cells.split(",")]
    options.work.mkdir(parents=True, exist_ok=True)
    options.out.mkdir(parents=True, exist_ok=True)
    days, cases = lump_cases(options.sets)
    press_block.INCREMENT_MM = STEP_MM * 1.001
    share = max(case["press_mm"][-1] / case["thickness_mm"] for case in cases.values())
    plain = [{"side_mm": 40.0, "shape": "none", "thickness_mm": mm, "young_Pa": 1e6,
              "press_mm": [mm * share * (k + 1) / PLAIN_STEPS for k in range(PLAIN_STEPS)]} for mm in PLAIN_MM]
    finest = [{**case, "press_mm": case["press_mm"][:FINEST_STEPS]} for case in plain]
    lumps = [list(dict.fromkeys(same)) for same in zip(*days)]  # each one's days
    asked = [(case, m) for m in PLAIN_CELLS[:-1] for case in plain] + [(case, PLAIN_CELLS[-1]) for case in finest]
    wanted = [(key, m) for m in cells for keys in lumps for key in keys]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as team:
        runs = list(team.map(lambda one: run_of(*one, options.work), asked + [(cases[k], m) for k, m in wanted]))
    rim = Rim(plain, [runs[k:len(asked):len(plain)] for k in range(len(plain))])
    runs, pressed = dict(zip(wanted, runs[len(asked):])), {}
    for keys in lumps:
        pressed |= finest_of(keys, cases, cells, runs, rim)
    for source, keys in zip(options.sets, days):
        write_copy(source, options.out / source.name, keys, pressed)
        print("wrote", options.out / source.name)


if __name__ == "__main__":
    main()
