"""Spline surfaces on the quads of another program beside those of `affine-atlas fit`, at the same number of control points, with the same fit and the same measures.

    (numpy, libigl, bpy: see quads.py)
    python3 benches/peers/splines.py PROGRAM FOLDER/bin/python DIR CELLS MESH...

Fits every mesh with PROGRAM (affine-atlas), asks QuadriFlow for quads until three of its meshes have as many control points within 2 %, and fits surfaces with them, of which the one with the least RMS counts (bench `spline_on_quads`, which finds places and creases by distance).
The same is done with the quads of `affine-atlas build`, their map thrown away: what that loses or gains is what the bench, and not QuadriFlow's quads, does. Leaves quads and surfaces in DIR and prints a table:

* RMS, max: distances both ways between the source and the surface (4 to 8 parts along a side of a cell), 1e-3 of the diagonal of the bounding box
* folded: cells in which a triangle of the surface looks away from the nearest point of the source (normals of vertices, interpolated)
* creases: edges of cells inside that are creases
* s: CPU seconds; of the quads, and of finding places and the fit
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from quads import ask_quadriflow, read_obj, resource_children, sampled, write_obj

WITHIN = 0.02
TRIES = 16
MESHES = 3


def bench():
    """The program of the bench."""
    said = subprocess.run(
        ["cargo", "bench", "--bench", "spline_on_quads", "--no-run", "--message-format", "json"],
        cwd=Path(__file__).parents[2],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    made = [json.loads(line) for line in said.stdout.splitlines()]
    return next(m["executable"] for m in made if m.get("executable") and m["target"]["name"] == "spline_on_quads")


def run(*command):
    start = resource_children()
    said = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    return said, resource_children() - start


def read_glb(path):
    data = path.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    head, body = json.loads(data[20 : 20 + length]), data[28 + length :]

    def array(accessor, kind, width):
        accessor = head["accessors"][accessor]
        start = head["bufferViews"][accessor["bufferView"]].get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(body, kind, accessor["count"] * width, start)

    primitive = head["meshes"][0]["primitives"][0]
    kind = {5123: np.uint16, 5125: np.uint32}[head["accessors"][primitive["indices"]]["componentType"]]
    points = array(primitive["attributes"]["POSITION"], np.float32, 3).reshape(-1, 3).astype(float)
    points += head["nodes"][0].get("translation", [0, 0, 0])
    return points, array(primitive["indices"], kind, 1).reshape(-1, 3).astype(np.int64)


def measure(source, faces, points, triangles, cells):
    import igl

    diagonal = np.linalg.norm(np.ptp(source, axis=0))
    there = np.concatenate([sampled(source, faces), source])
    back = np.concatenate([sampled(points, triangles), points])
    to = igl.point_mesh_squared_distance(there, points, triangles)[0]
    fro = igl.point_mesh_squared_distance(back, source, faces)[0]
    p = points[triangles]
    _, nearest, at = igl.point_mesh_squared_distance(p.mean(1), source, faces)
    a, b, c = [np.ascontiguousarray(source[faces[nearest.ravel(), k]]) for k in range(3)]
    weights = np.stack([np.linalg.norm(np.cross(v - at, w - at), axis=1) for v, w in [(b, c), (c, a), (a, b)]], 1)
    beside = np.einsum("ik,ikj->ij", weights, igl.per_vertex_normals(source, faces)[faces[nearest.ravel()]])
    away = (np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) * beside).sum(1) < 0
    return {
        "RMS": "%.3f" % (1e3 * np.sqrt((to.mean() + fro.mean()) / 2) / diagonal),
        "max": "%.2f" % (1e3 * np.sqrt(max(to.max(), fro.max())) / diagonal),
        "folded": away.reshape(cells, -1).any(1).sum(),
    }


def ours(program, mesh, folder, cells):
    out = folder / f"{mesh.stem}.fit"
    said, seconds = run(program, "fit", "--quiet", mesh, "--cells", cells, "--out", out)
    if said.returncode:
        raise SystemExit(said.stderr)
    [component] = json.loads((out / "fit.json").read_text())["components"]
    return component, read_glb(out / f"{component['name']}.glb"), seconds


def as_many(python, plain, folder, wanted):
    """Quad meshes of QuadriFlow with so many points, and the seconds of each; else a message."""
    asked, found = set(), []
    cells, nearest = wanted, None
    while len(asked) < TRIES and len(found) < MESHES:
        path = folder / f"{plain.name.split('.')[0]}.quadriflow.{cells}.obj"
        made = ask_quadriflow(python, plain, path, cells)
        if made is None:
            return "failed"
        points, _, seconds = made
        asked.add(cells)
        if abs(len(points) - wanted) <= WITHIN * wanted:
            found.append((path, seconds))
        if nearest is None or abs(len(points) - wanted) < abs(nearest - wanted):
            nearest = len(points)
        cells = round(cells * wanted / len(points))
        # Its numbers jump.
        while cells in asked:
            cells += round(WITHIN * wanted / 4)
    return found or f"{nearest} points at the nearest"


def on_quads(fitter, plain, quads, folder):
    """The fit on quads, and what it prints; a message where there is none."""
    path = folder / f"{quads.stem}.surface.obj"
    said, seconds = run(fitter, plain, quads, path)
    if said.returncode:
        return said.stderr.strip().splitlines()[-1]
    points, triangles = read_obj(path)
    return json.loads(said.stdout), (points, np.array(triangles, dtype=np.int64)), seconds


def same_quads(program, mesh, folder, cells):
    """The quads that `fit` begins with."""
    out = folder / "atlas"
    said, seconds = run(
        *[program, "build", "--quiet", "--force", mesh, "--out", out, "--set", "images.domain=grid"],
        *["--set", f"grid.cells={cells}", "--set", "pictures.enabled=false", "--set", "report.enabled=false"],
    )
    if said.returncode:
        raise SystemExit(said.stderr)
    path = folder / f"{mesh.stem}.own.obj"
    write_obj(path, *read_obj(next(out.glob(f"{mesh.stem}/quads.obj"))))
    return path, seconds


def main(program, python, folder, cells, meshes):
    import igl

    fitter = bench()
    folder.mkdir(parents=True, exist_ok=True)
    print("| model | quads | control points | RMS | max | folded | creases | s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for mesh in meshes:
        source, faces = igl.read_triangle_mesh(str(mesh))
        faces = faces.astype(np.int64)
        plain = folder / f"{mesh.stem}.source.obj"
        write_obj(plain, source, faces.tolist())

        def row(name, figures, surface, seconds):
            measured = measure(source, faces, *surface, figures["cells"])
            words = [mesh.stem, name, figures["control_points"], *measured.values(), figures["crease_edges"], seconds]
            print("|", " | ".join(str(x) for x in words), "|", flush=True)

        figures, surface, seconds = ours(program, mesh, folder, cells)
        row("affine-atlas", figures, surface, "%.1f" % seconds)
        def least(name, quads):
            results = [(on_quads(fitter, plain, path, folder), seconds) for path, seconds in quads]
            fitted = [(result, seconds) for result, seconds in results if not isinstance(result, str)]
            if not fitted:
                return print(f"| {mesh.stem} | {name} | {results[0][0]} |", flush=True)
            (figures, surface, last), first = min(fitted, key=lambda r: r[0][0]["both_ways_rms"])
            row(name, figures, surface, f"{first:.1f} + {last:.1f}")

        least("the same without its map", [same_quads(program, mesh, folder, cells)])
        found = as_many(python, plain, folder, figures["control_points"])
        if isinstance(found, str):
            print(f"| {mesh.stem} | QuadriFlow | {found} |", flush=True)
        else:
            least("QuadriFlow", found)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]), int(sys.argv[4]), [Path(m) for m in sys.argv[5:]])
