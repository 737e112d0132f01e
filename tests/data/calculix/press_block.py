#!/usr/bin/python3
"""Presses a block of tissue by CalculiX on meshes that become finer, and writes the pressure on the plate as palpate's
maps have it, with how far the meshes agree.

    press_block.py NAME [--cells 2,3] [--work FOLDER] [--out FOLDER]

NAME is one of cases.json. What ccx answered on each mesh is kept in the work folder and not run again; a block with a
lump wants the block of tissue alone ("plain") of the same press and thickness there.
"""

import argparse
import json
import os
import pathlib
import subprocess
import tempfile
import time

import numpy as np

from block_mesh import mesh_of

HERE = pathlib.Path(__file__).parent
POISSON = 0.495
NODES, PITCH_MM = 33, 1.25
INCREMENT_MM = 0.8  # of the plate, at most


def deck(case, mesh, loads_mm):
    """The input of ccx: lengths in mm, stress in the tissue's modulus. A load is a step of its own."""
    half, thickness = case["side_mm"] / 2, case["thickness_mm"]
    sets = {"TOP": (2, 0), "FLOOR": (2, thickness), "XPLANE": (0, 0), "YPLANE": (1, 0), "XSIDE": (0, half)}
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n + 1},{x:.9g},{y:.9g},{z:.9g}" for n, (x, y, z) in enumerate(mesh.nodes)]
    for name, lump in (("TISSUE", False), ("LUMP", True)):
        if not np.any(mesh.lump == lump):
            continue
        lines.append(f"*ELEMENT, TYPE=C3D20R, ELSET={name}")
        for e in np.flatnonzero(mesh.lump == lump):
            n = [str(v + 1) for v in mesh.cells[e]]
            lines += [",".join([str(e + 1), *n[:10]]) + ",", ",".join(n[10:])]
        young = case["ratio"] if lump else 1
        mu, kappa = young / (2 * (1 + POISSON)), young / (3 * (1 - 2 * POISSON))
        lines += [f"*MATERIAL, NAME=M{name}", "*HYPERELASTIC, NEO HOOKE", f"{mu / 2:.10g},{2 / kappa:.10g}",
                  f"*SOLID SECTION, ELSET={name}, MATERIAL=M{name}"]
    for name, (axis, at) in sets.items():
        lines.append(f"*NSET, NSET={name}")
        lines += [str(n + 1) for n in np.flatnonzero(abs(mesh.nodes[:, axis] - at) < 1e-6)]
    lines += ["*BOUNDARY", "FLOOR,1,3", "XPLANE,1,1", "YPLANE,2,2"]
    part, to_mm = INCREMENT_MM / loads_mm[-1], loads_mm[-1]
    lines += ["*TIME POINTS, NAME=LOADS", *(f"{way / to_mm:.9g}" for way in loads_mm),
              "*STEP, NLGEOM, INC=500", "*STATIC, SOLVER=SPOOLES", f"{part:.6g},1.,1e-4,{part:.6g}",
              "*CONTROLS, PARAMETERS=FIELD", "1e-4,1e-2", "*BOUNDARY", f"TOP,3,3,{to_mm:.9g}",
              "*NODE PRINT, NSET=TOP, TIME POINTS=LOADS", "U,RF",
              "*NODE PRINT, NSET=XSIDE, TIME POINTS=LOADS", "U", "*NODE FILE, FREQUENCY=0", "*END STEP"]
    return "\n".join(lines) + "\n"


def run_ccx(folder, text):
    (folder / "block.inp").write_text(text)
    start = time.time()
    done = subprocess.run(["ccx", "block"], cwd=folder, env={**os.environ, "OMP_NUM_THREADS": "1"},
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    (folder / "block.log").write_text(done.stdout)
    if "Job finished" not in done.stdout:
        raise RuntimeError("ccx ended early:\n" + done.stdout[-1500:])
    return time.time() - start


def read_dat(path):
    """Tables of block.dat in their order: (what, set, node numbers from 0, values)."""
    tables, rows, head = [], [], None
    for line in [*path.read_text().splitlines(), " end for set END and time 0"]:
        if "for set" in line:
            if head:
                table = np.array(rows)
                tables.append((*head, table[:, 0].astype(int) - 1, table[:, 1:]))
            words = line.split()
            head, rows = (words[0], words[words.index("set") + 1]), []
        elif line.strip():
            rows.append([float(v) for v in line.split()])
    return tables


def shapes8(a, b):
    """Shape functions of the face of 8 nodes and their slopes: (places, 8) each."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    n, da, db = [], [], []
    for s, t in corners:
        n.append((1 + s * a) * (1 + t * b) * (s * a + t * b - 1) / 4)
        da.append(s * (1 + t * b) * (2 * s * a + t * b) / 4)
        db.append(t * (1 + s * a) * (s * a + 2 * t * b) / 4)
    for s, t in ((0, -1), (1, 0), (0, 1), (-1, 0)):
        if s == 0:
            n.append((1 - a * a) * (1 + t * b) / 2)
            da.append(-a * (1 + t * b))
            db.append(t * (1 - a * a) / 2)
        else:
            n.append((1 - b * b) * (1 + s * a) / 2)
            da.append(s * (1 - b * b) / 2)
            db.append(-b * (1 + s * a))
    return np.stack(n, -1), np.stack(da, -1), np.stack(db, -1)


def top_faces(mesh, top):
    """The faces on the surface, eight nodes each, as places in `top`."""
    place = np.full(len(mesh.nodes), -1)
    place[top] = np.arange(len(top))
    faces = []
    for face, middles in (((0, 1, 2, 3), (8, 9, 10, 11)), ((4, 5, 6, 7), (12, 13, 14, 15)),
                          ((0, 1, 5, 4), (8, 17, 12, 16)), ((1, 2, 6, 5), (9, 18, 13, 17)),
                          ((2, 3, 7, 6), (10, 19, 14, 18)), ((3, 0, 4, 7), (11, 16, 15, 19))):
        nodes = place[mesh.cells[:, [*face, *middles]]]
        faces.append(nodes[np.all(nodes >= 0, axis=1)])
    return np.concatenate(faces)


def pressure_map(faces, at, force, spots=48):
    """Means of the pressure over squares around the map's nodes, and the pressure's force. `at`: places of the
    surface's nodes under the plate, of one quarter; `force`: theirs, into the tissue. The pressure is the one whose
    work on the elements' own shapes is the forces'."""
    g = np.sqrt(0.6) * np.array([-1, 0, 1])
    w = np.array([5, 8, 5]) / 9
    a, b = (v.reshape(-1) for v in np.meshgrid(g, g))
    n, da, db = shapes8(a, b)
    weight = np.outer(w, w).reshape(-1)

    def area(da, db):
        xa, ya, xb, yb = da @ at[faces, 0].T, da @ at[faces, 1].T, db @ at[faces, 0].T, db @ at[faces, 1].T
        return np.abs(xa * yb - ya * xb)  # places x faces

    mass = np.zeros((len(at), len(at)))
    local = np.einsum("p,pf,pi,pj->fij", weight, area(da, db), n, n)
    np.add.at(mass, (faces[:, :, None], faces[:, None, :]), local)
    pressure = np.linalg.solve(mass, force)

    fine = (np.arange(spots) + 0.5) / spots * 2 - 1
    a, b = (v.reshape(-1) for v in np.meshgrid(fine, fine))
    n, da, db = shapes8(a, b)
    part = area(da, db) * (2 / spots) ** 2
    x, y = n @ at[faces, 0].T, n @ at[faces, 1].T
    value = n @ pressure[faces].T
    column, row = np.floor(x / PITCH_MM + 0.5).astype(int), np.floor(y / PITCH_MM + 0.5).astype(int)
    half = NODES // 2
    inside = (column <= half) & (row <= half)
    sums, covered = np.zeros((half + 1, half + 1)), np.zeros((half + 1, half + 1))
    np.add.at(sums, (row[inside], column[inside]), (value * part)[inside])
    np.add.at(covered, (row[inside], column[inside]), part[inside])
    quarter = sums / np.maximum(covered, 1e-12)
    rows = np.concatenate([quarter[:0:-1], quarter])
    return np.concatenate([rows[:, :0:-1], rows], axis=1), float((value * part).sum())


def press(case, m, folder):
    """One mesh: for each load its force in N and its map in Pa, with what the run was."""
    mesh, loads = mesh_of(case, m), case["press_mm"]
    wall_s = run_ccx(folder, deck(case, mesh, loads))
    tables = read_dat(folder / "block.dat")

    def of(what, where):
        return [t[2:] for t in tables if t[0] == what and t[1] == where]

    out = []
    for way, (top, u), (same, f), (side, v) in zip(loads, of("displacements", "TOP"), of("forces", "TOP"),
                                                   of("displacements", "XSIDE")):
        if not (np.array_equal(top, same) and np.allclose(u[:, 2], way, atol=1e-5)):
            raise RuntimeError("ccx wrote another load than was asked for")
        values, carried = pressure_map(top_faces(mesh, top), (mesh.nodes[top] + u)[:, :2], f[:, 2])
        below = (mesh.nodes[side] + v)[:, 2].max() - case["thickness_mm"]
        out.append({"press_mm": way, "force_N": 4e-6 * case["young_Pa"] * float(f[:, 2].sum()),
                    "below_floor_mm": max(0.0, float(below)), "map_force_error": abs(carried / f[:, 2].sum() - 1),
                    "pressure_Pa": (values * case["young_Pa"]).tolist()})
    return {"cells": m, "nodes": len(mesh.nodes), "elements": len(mesh.cells), "wall_s": wall_s, "loads": out}


def run_of(name, case, m, work):
    """A mesh's answer, from the work folder or by ccx."""
    kept = work / f"{name}_{m}.json"
    if not kept.exists():
        folder = work / f"{name}_{m}"
        folder.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(press(case, m, folder)))
    return json.loads(kept.read_text())


def values_of(run, load):
    """Force and map of a load in one array."""
    return np.array([run["loads"][load]["force_N"], *np.ravel(run["loads"][load]["pressure_Pa"])])


def order_of(cells, forces):
    """The power of the cells' size with which three forces converge."""
    wanted = (forces[0] - forces[1]) / (forces[1] - forces[2])
    low, high = 0.3, 4.0
    for _ in range(60):
        order = (low + high) / 2
        a, b, c = (m ** -order for m in cells)
        low, high = (order, high) if (a - b) / (b - c) < wanted else (low, order)
    return order


def rim_errors(plain, load):
    """What each mesh's force on tissue alone is off by, which the rim of the floor makes, the order of it, and the
    pressure that each N of it is on the middle of the map, over which it is nearly even."""
    cells = [run["cells"] for run in plain[-3:]]
    forces = [run["loads"][load]["force_N"] for run in plain[-3:]]
    order = order_of(cells, forces)
    scale = (forces[1] - forces[2]) / (cells[1] ** -order - cells[2] ** -order)
    a, b = (np.array(run["loads"][load]["pressure_Pa"])[5:-5, 5:-5].mean() for run in plain[-2:])
    return {run["cells"]: scale * run["cells"] ** -order for run in plain}, order, (a - b) / (forces[1] - forces[2])


def combine(runs, plain, load):
    """From two meshes to cells of no size: the rim's part as tissue alone has it, the rest with the square.
    Returns force and map in one array, what was added to them, and the rim's part of the force and its order."""
    coarse, fine = runs[-2:]
    errors, order, pressure_per_N = rim_errors(plain, load)
    a, b = values_of(coarse, load), values_of(fine, load)
    for values, run in ((a, coarse), (b, fine)):
        values[0] -= errors[run["cells"]]
        values[1:] -= errors[run["cells"]] * pressure_per_N
    rest = (b - a) / ((fine["cells"] / coarse["cells"]) ** 2 - 1)
    return b + rest, rest, errors[fine["cells"]], order


def rms(values, peak):
    return float(np.sqrt(np.mean(np.asarray(values).reshape(NODES, NODES)[1:-1, 1:-1] ** 2)) / peak)


def write(name, case, runs, plain, out):
    told = {"name": name, **case, "poisson": POISSON, "program": "CalculiX 2.20, C3D20R, *HYPERELASTIC, NEO HOOKE",
            "meshes": [{k: run[k] for k in ("cells", "nodes", "elements")} for run in runs], "loads": []}
    for k, way in enumerate(case["press_mm"]):
        values, rest, rim, order = combine(runs, plain, k)
        peak = values[1:].max()
        file = f"{name}_{k + 1}.csv"
        np.savetxt(out / file, values[1:].reshape(NODES, NODES), fmt="%.2f", delimiter=",")
        told["loads"].append({
            "press_mm": way, "file": file, "force_N": round(values[0], 6),
            "force_on_meshes_N": [round(run["loads"][k]["force_N"], 6) for run in runs],
            "rim_order": round(order, 3), "rim_added_N": round(-rim, 6), "rest_added_N": round(rest[0], 6),
            "map_between_meshes_rms_over_peak":
                rms(values_of(runs[-1], k)[1:] - values_of(runs[-2], k)[1:], peak),
            "map_added_rms_over_peak": rms(rest[1:], peak),
            "below_floor_mm": round(runs[-1]["loads"][k]["below_floor_mm"], 3)})
    (out / f"{name}.json").write_text(json.dumps(told, indent=1) + "\n")
    return told


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name")
    parser.add_argument("--cells", default="2,3", help="meshes, the finest last: cells along half of the lump's core")
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path(tempfile.gettempdir()) / "calculix")
    parser.add_argument("--out", type=pathlib.Path, default=HERE)
    options = parser.parse_args()
    cases = json.loads((HERE / "cases.json").read_text())
    case = {"side_mm": 40.0, **cases[options.name]}
    options.work.mkdir(parents=True, exist_ok=True)
    runs = [run_of(options.name, case, int(m), options.work) for m in options.cells.split(",")]
    plain_case = {"side_mm": 40.0, **cases["plain"], "press_mm": case["press_mm"]}
    kept = sorted(int(p.stem.split("_")[1]) for p in options.work.glob("plain_*.json"))
    plain = [run_of("plain", plain_case, m, options.work) for m in kept]
    if len(plain) < 3:
        print(f"{options.name}: meshes kept; three of plain are wanted before maps are written")
        return
    for load in write(options.name, case, runs, plain, options.out)["loads"]:
        print(options.name, json.dumps(load))


if __name__ == "__main__":
    main()
