"""Quad meshes of other programs beside `quads.obj`, at the same number of quads and with the same measures.

    pip install numpy libigl pynanoinstantmeshes
    python3 -m venv FOLDER && FOLDER/bin/pip install bpy          (QuadriFlow; it needs a numpy of its own)
    python3 benches/peers/quads.py PROGRAM FOLDER/bin/python DIR CELLS MESH...

Builds every mesh with PROGRAM (affine-atlas) and asks QuadriFlow and Instant Meshes for as many quads as that has; leaves the quad meshes in DIR and prints a table:

* irregular: vertices inside with other than 4 edges, and on the border with other than 3
* angle: smallest angle of a cell, degrees: below which 5 % of cells are, and median
* edges: 95 % over 5 % of edge lengths
* RMS, Hausdorff: distances both ways between the source and the cells (bilinear, 4 x 4 pieces each), 1e-3 of the diagonal of the bounding box
* folded: cells with a corner whose normal looks away from that of the nearest point of the source (normals of vertices, interpolated)
* other: polygons that are no quads; parts: components, beside those of the source
"""

import json
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

PIECES = 4
SAMPLES = 100_000


def read_obj(path):
    points, faces = [], []
    for line in open(path):
        words = line.split()
        if words[:1] == ["v"]:
            points.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
    return np.array(points), faces


def write_obj(path, points, faces):
    with open(path, "w") as out:
        out.writelines("v %.9g %.9g %.9g\n" % tuple(p) for p in points)
        out.writelines("f " + " ".join(str(i + 1) for i in f) + "\n" for f in faces)


def quadriflow(source, target, cells):
    """Runs under the Python that has bpy."""
    import bpy

    points, faces = read_obj(source)
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(points.tolist(), [], faces)
    thing = bpy.data.objects.new("mesh", mesh)
    bpy.context.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    start = time.process_time()
    result = bpy.ops.object.quadriflow_remesh(
        use_mesh_symmetry=False, use_preserve_sharp=True, use_preserve_boundary=True, mode="FACES", target_faces=cells, seed=0
    )
    seconds = time.process_time() - start
    if "FINISHED" in result:
        made = bpy.context.object.data
        write_obj(target, [v.co for v in made.vertices], [list(p.vertices) for p in made.polygons])
    print(json.dumps({"seconds": seconds}))


def ask_quadriflow(python, source, target, cells):
    """Points, polygons and seconds; None where it failed."""
    target.unlink(missing_ok=True)
    said = subprocess.run([python, __file__, "--quadriflow", source, target, str(cells)], capture_output=True, text=True)
    if not target.exists():
        return None
    lines = [line for line in said.stdout.splitlines() if line.startswith('{"seconds"')]
    return *read_obj(target), json.loads(lines[-1])["seconds"]


def instant(points, faces, cells):
    import pynanoinstantmeshes

    start = time.process_time()
    # It divides each polygon into quads at the end.
    made, polygons = pynanoinstantmeshes.remesh(
        points.astype(np.float32), faces.astype(np.uint32), -1, 4, 4, -1.0, cells // 4, 0.0, True, deterministic=True
    )
    return made, [list(dict.fromkeys(int(i) for i in p)) for p in polygons], time.process_time() - start


def pieces(points, quads):
    """Triangles of bilinear cells."""
    t = np.linspace(0, 1, PIECES + 1)
    u, v = [x.ravel() for x in np.meshgrid(t, t)]
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], 1)
    vertices = np.einsum("ij,qjk->qik", weights, points[quads]).reshape(-1, 3)
    n = PIECES + 1
    i, j = [x.ravel() for x in np.meshgrid(np.arange(PIECES), np.arange(PIECES))]
    a = j * n + i
    cell = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)])
    return vertices, (cell[None] + (np.arange(len(quads)) * n * n)[:, None, None]).reshape(-1, 3)


def sampled(points, triangles):
    random = np.random.default_rng(0)
    p = points[triangles]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    which = random.choice(len(triangles), SAMPLES, p=area / area.sum())
    a, b = random.random((2, SAMPLES))
    over = a + b > 1
    a[over], b[over] = 1 - a[over], 1 - b[over]
    q = p[which]
    return q[:, 0] + a[:, None] * (q[:, 1] - q[:, 0]) + b[:, None] * (q[:, 2] - q[:, 0])


def components(count, faces):
    root = list(range(count))

    def find(i):
        while root[i] != i:
            root[i] = root[root[i]]
            i = root[i]
        return i

    for f in faces:
        for i in f[1:]:
            root[find(i)] = find(f[0])
    return len({find(i) for f in faces for i in f})


def measure(source, faces, points, polygons):
    import igl

    diagonal = np.linalg.norm(np.ptp(source, axis=0))
    quads = np.array([p for p in polygons if len(p) == 4], dtype=np.int64)
    edges = Counter(tuple(sorted((f[k - 1], f[k]))) for f in polygons for k in range(len(f)))
    border = {i for edge, n in edges.items() if n == 1 for i in edge}
    valence = Counter(i for edge in edges for i in edge)
    irregular = sum(n != (3 if i in border else 4) for i, n in valence.items())
    p = points[quads]
    ahead, behind = np.roll(p, -1, 1) - p, np.roll(p, 1, 1) - p
    cosine = (ahead * behind).sum(2) / np.maximum(np.linalg.norm(ahead, axis=2) * np.linalg.norm(behind, axis=2), 1e-300)
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1))).min(1)
    lengths = [np.linalg.norm(points[a] - points[b]) for a, b in edges]
    vertices, triangles = pieces(points, quads)
    others = [[f[0], f[k], f[k + 1]] for f in polygons if len(f) != 4 for k in range(1, len(f) - 1)]
    if others:
        triangles = np.concatenate([triangles, np.array(others) + len(vertices)])
        vertices = np.concatenate([vertices, points])
    there = np.concatenate([sampled(source, faces), source])
    back = np.concatenate([sampled(vertices, triangles), points])
    to = igl.point_mesh_squared_distance(there, vertices, triangles)[0]
    fro = igl.point_mesh_squared_distance(back, source, faces)[0]
    normal = np.cross(ahead, behind).reshape(-1, 3)
    _, nearest, at = igl.point_mesh_squared_distance(p.reshape(-1, 3), source, faces)
    a, b, c = [np.ascontiguousarray(source[faces[nearest.ravel(), k]]) for k in range(3)]
    weights = np.stack([np.linalg.norm(np.cross(v - at, w - at), axis=1) for v, w in [(b, c), (c, a), (a, b)]], 1)
    normals = igl.per_vertex_normals(source, faces)[faces[nearest.ravel()]]
    beside = np.einsum("ik,ikj->ij", weights, normals)
    folded = ((normal * beside).sum(1) < 0).reshape(-1, 4).any(1).sum()
    return {
        "quads": len(quads),
        "irregular": irregular,
        "angle": "%.0f, %.0f" % (np.percentile(angle, 5), np.median(angle)),
        "edges": "%.2f" % (np.percentile(lengths, 95) / np.percentile(lengths, 5)),
        "RMS": "%.3f" % (1e3 * np.sqrt((to.mean() + fro.mean()) / 2) / diagonal),
        "Hausdorff": "%.2f" % (1e3 * np.sqrt(max(to.max(), fro.max())) / diagonal),
        "folded": folded,
        "other": len(polygons) - len(quads),
        "parts": components(len(points), polygons) - components(len(source), faces.tolist()),
    }


def ours(program, mesh, folder, cells):
    out = folder / "atlas"
    start = time.process_time(), resource_children()
    subprocess.run(
        [program, "build", "--quiet", "--force", mesh, "--out", out, "--set", f"grid.cells={cells}", "--threads", "1"]
        + ["--set", "pictures.enabled=false", "--set", "report.enabled=false"],
        check=True,
    )
    seconds = resource_children() - start[1]
    return read_obj(next(out.glob(f"{mesh.stem}/quads.obj"))), seconds


def resource_children():
    import resource

    use = resource.getrusage(resource.RUSAGE_CHILDREN)
    return use.ru_utime + use.ru_stime


def main(program, python, folder, cells, meshes):
    import igl

    folder.mkdir(parents=True, exist_ok=True)
    print("| model | program | quads | irregular | angle 5 %, median | edges 95/5 % | RMS | Hausdorff | folded | other | parts | s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for mesh in meshes:
        source, faces = igl.read_triangle_mesh(str(mesh))
        faces = faces.astype(np.int64)
        plain = folder / f"{mesh.stem}.source.obj"
        write_obj(plain, source, faces.tolist())
        (points, polygons), seconds = ours(program, mesh, folder, cells)
        made = {"affine-atlas": (points, polygons, seconds)}
        count = len(polygons)
        if asked := ask_quadriflow(python, plain, folder / f"{mesh.stem}.quadriflow.obj", count):
            made["QuadriFlow"] = asked
        made["Instant Meshes"] = instant(source, faces, count)
        for name, (points, polygons, seconds) in made.items():
            write_obj(folder / f"{mesh.stem}.{name.replace(' ', '-').lower()}.obj", points, polygons)
            row = measure(source, faces, np.asarray(points, dtype=float), polygons)
            print("|", " | ".join(str(x) for x in [mesh.stem, name, *row.values(), "%.1f" % seconds]), "|", flush=True)
        if "QuadriFlow" not in made:
            print(f"| {mesh.stem} | QuadriFlow | failed |", flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "--quadriflow":
        quadriflow(sys.argv[2], sys.argv[3], int(sys.argv[4]))
    else:
        main(sys.argv[1], sys.argv[2], Path(sys.argv[3]), int(sys.argv[4]), [Path(m) for m in sys.argv[5:]])
