"""Spline surfaces on the quads of another program beside those of `affine-atlas fit`, at the same number of control points, with the same fit and the same measures.

    (numpy, libigl, scipy, bpy: see quads.py)
    python3 benches/peers/splines.py PROGRAM FOLDER/bin/python DIR CELLS MESH...

Fits every mesh with PROGRAM (affine-atlas), asks QuadriFlow for quads until three of its meshes have as many control points within 2 %, and fits surfaces with them, of which the one with the least RMS counts (bench `spline_on_quads`). Samples of the mesh begin at the nearest places of the cells that do not look away, edges of cells are creases where sharp edges of the mesh lie along them.
The same is done with the quads of `affine-atlas build`, their map thrown away: what that loses or gains is what is done here, not QuadriFlow's quads. Leaves quads and surfaces in DIR and prints a table:

* RMS, max: distances both ways between the source and the surface (4 to 8 parts along a side of a cell), 1e-3 of the diagonal of the bounding box
* away: cells in which a triangle of the surface looks away from the nearest point of the source (normals of vertices, interpolated)
* folded: part of the area that is turned over, as in fit.json
* creases: edges of cells inside that are creases
* s: CPU seconds; of the quads, and of the fit
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from quads import ask_quadriflow, pieces, read_obj, resource_children, sampled, write_obj

SAMPLES = 30  # a cell
PLACES = 16  # of an edge of cells that are looked at for sharp edges of the mesh
BESIDE, ALONG = 0.1, np.cos(np.radians(30))  # how far away these may be, in lengths of the edge, and how much they may turn from it
NEAR = 24  # triangles among which one is looked for that does not look away
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
        "away": away.reshape(cells, -1).any(1).sum(),
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


def places(source, faces, points, quads):
    """Samples of a mesh, and the nearest places of bilinear cells: x y z, normal, area, cell, s t."""
    import igl
    from scipy.spatial import cKDTree

    p = source[faces]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2
    parts = np.clip(np.ceil(np.sqrt(SAMPLES * len(quads) * area / area.sum())), 1, 64).astype(int)
    samples = []
    for n in np.unique(parts):
        i, j = [x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n))]
        up, down = i + j < n, i + j < n - 1
        b, c = [np.concatenate([(x + 1 / 3)[up], (x + 2 / 3)[down]]) / n for x in (i, j)]
        weights = np.stack([1 - b - c, b, c], 1)
        own = np.flatnonzero(parts == n)
        corner = igl.per_corner_normals(source, faces, 40.0).reshape(-1, 3, 3)[own]
        normal = np.einsum("wk,fki->fwi", weights, corner).reshape(-1, 3)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        point = np.einsum("wk,fki->fwi", weights, p[own]).reshape(-1, 3)
        samples.append(np.concatenate([point, normal, np.repeat(area[own] / n**2, n * n)[:, None]], 1))
    samples = np.concatenate(samples)
    vertices, triangles = pieces(points, quads)
    c = vertices[triangles]
    looks = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    _, nearest, at = igl.point_mesh_squared_distance(np.ascontiguousarray(samples[:, :3]), vertices, triangles)
    nearest, at = nearest.ravel(), np.array(at)
    away = np.flatnonzero((looks[nearest] * samples[:, 3:6]).sum(1) <= 0)
    if len(away):
        _, among = cKDTree(c.mean(1)).query(samples[away, :3], NEAR)
        first = ((looks[among] * samples[away, None, 3:6]).sum(2) > 0).argmax(1)
        nearest[away] = among[np.arange(len(away)), first]
        at[away] = c[nearest[away]].mean(1)
    # Corners of triangles in their cells; triangles come cell by cell.
    side = round(np.sqrt(len(vertices) / len(quads)))
    number = triangles[nearest] % (side * side)
    corner = np.stack([number % side, number // side], 2) / (side - 1)
    a, b, d = c[nearest].transpose(1, 0, 2)
    whole = looks[nearest]
    of = [np.cross(v - at, w - at) for v, w in ((b, d), (d, a), (a, b))]
    weights = np.stack([(x * whole).sum(1) for x in of], 1) / np.maximum((whole * whole).sum(1), 1e-300)[:, None]
    place = np.clip(np.einsum("nk,nki->ni", weights, corner), 0, 1)
    cell = triangles[nearest, 0] // (side * side)
    return np.concatenate([samples, cell[:, None], place], 1)


def covers(source, faces, points, quads):
    """Edges of cells that sharp edges of a mesh lie along: ends, and the parts along those above 20 and 40 degrees."""
    import igl

    normals = igl.per_face_normals(source, faces, np.array([0.0, 0.0, 1.0]))
    beside = {}
    for f, corners in enumerate(faces):
        for k in range(3):
            beside.setdefault(tuple(sorted((corners[k], corners[k - 1]))), []).append(f)
    two = [(edge, fs) for edge, fs in beside.items() if len(fs) == 2]
    ends = np.array([edge for edge, _ in two])
    turned = np.degrees(np.arccos(np.clip([normals[a] @ normals[b] for _, (a, b) in two], -1, 1)))
    rows = []
    for a, b in sorted({tuple(sorted((int(q[k]), int(q[k - 1])))) for q in quads for k in range(4)}):
        p, d = points[a], points[b] - points[a]
        length = np.linalg.norm(d)
        parts = []
        for angle in (20, 40):
            c, e = source[ends[turned > angle, 0]], source[ends[turned > angle, 1]]
            long = np.linalg.norm(e - c, axis=1)
            near = np.linalg.norm((c + e) / 2 - p - d / 2, axis=1) <= (0.5 + BESIDE) * length + long / 2
            near &= np.abs((e - c) @ d) >= ALONG * length * long
            c, e = c[near], e[near]
            x = p + (np.arange(PLACES)[:, None] + 0.5) / PLACES * d
            t = ((x[:, None] - c) * (e - c)).sum(2) / np.maximum(((e - c) ** 2).sum(1), 1e-300)
            off = np.linalg.norm(x[:, None] - c - np.clip(t, 0, 1)[:, :, None] * (e - c), axis=2)
            parts.append((off <= BESIDE * length).any(1).mean())
        if parts[0] > 0:
            rows.append([a, b, *parts])
    return rows


def on_quads(fitter, source, faces, quads, folder):
    """The fit on quads, and what it prints; a message where there is none."""
    points, polygons = read_obj(quads)
    if any(len(f) != 4 for f in polygons):
        return "not only quads"
    cells = np.array(polygons)
    paths = [folder / f"{quads.stem}.{name}" for name in ("samples.txt", "sharp.txt", "surface.obj")]
    np.savetxt(paths[0], places(source, faces, points, cells), "%.12g")
    paths[1].write_text("".join("%d %d %g %g\n" % tuple(row) for row in covers(source, faces, points, cells)))
    said, seconds = run(fitter, quads, *paths, str(len(faces)))
    if said.returncode:
        return said.stderr.strip().splitlines()[-1]
    points, triangles = read_obj(paths[2])
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
    print("| model | quads | control points | RMS | max | away | folded | creases | s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for mesh in meshes:
        source, faces = igl.read_triangle_mesh(str(mesh))
        faces = faces.astype(np.int64)
        plain = folder / f"{mesh.stem}.source.obj"
        write_obj(plain, source, faces.tolist())

        def row(name, figures, surface, seconds):
            measured = measure(source, faces, *surface, figures["cells"])
            figures = [figures["control_points"], *measured.values(), "%.1e" % figures["turned_over_area"], figures["crease_edges"]]
            words = [mesh.stem, name, *figures, seconds]
            print("|", " | ".join(str(x) for x in words), "|", flush=True)

        figures, surface, seconds = ours(program, mesh, folder, cells)
        row("affine-atlas", figures, surface, "%.1f" % seconds)
        def least(name, quads):
            results = [(on_quads(fitter, source, faces, path, folder), seconds) for path, seconds in quads]
            fitted = [(result, seconds) for result, seconds in results if not isinstance(result, str)]
            if not fitted:
                return print(f"| {mesh.stem} | {name} | {results[0][0]} |", flush=True)
            (figures, surface, last), first = min(fitted, key=lambda r: float(measure(source, faces, *r[0][1], r[0][0]["cells"])["RMS"]))
            row(name, figures, surface, f"{first:.1f} + {last:.1f}")

        least("the same without its map", [same_quads(program, mesh, folder, cells)])
        found = as_many(python, plain, folder, figures["control_points"])
        if isinstance(found, str):
            print(f"| {mesh.stem} | QuadriFlow | {found} |", flush=True)
        else:
            least("QuadriFlow", found)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]), int(sys.argv[4]), [Path(m) for m in sys.argv[5:]])
