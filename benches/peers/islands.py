"""Islands of texture coordinates of default builds beside those of xatlas: how many, how long their borders are, how much they fill.

    pip install numpy xatlas libigl
    python3 benches/peers/islands.py PROGRAM MESH...

Prints a row of a table a mesh: islands, length of their borders in diagonals of the model (borders of the surface itself left out), part of
the picture that is filled (ours is a square, that of xatlas as wide and high as it makes it at 512), sqrt(texels per area) (95 % over 5 % of the
area); each ours and that of xatlas, with as many texels of padding.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import igl
import numpy as np
import xatlas

SIDE = 512
PADDING = 2


def measure(positions, faces, uv, square):
    """Of triangles with texture coordinates at their corners, in a picture of so much area."""
    spaces = {}
    for f, corners in enumerate(faces):
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            spaces.setdefault((min(a, b), max(a, b)), []).append((f, k, a < b))
    parent = np.arange(len(faces))

    def find(f):
        while parent[f] != f:
            parent[f] = parent[parent[f]]
            f = parent[f]
        return f

    near = 1e-6 * np.sqrt(square)
    border = 0.0
    for (a, b), sides in spaces.items():
        if len(sides) != 2:
            continue
        ends = [uv[f, [k, (k + 1) % 3]][:: 1 if forward else -1] for f, k, forward in sides]
        if np.abs(ends[0] - ends[1]).max() <= near:
            parent[find(sides[0][0])] = find(sides[1][0])
        else:
            border += np.linalg.norm(positions[a] - positions[b])
    islands = len({find(f) for f in range(len(faces))})
    diagonal = np.linalg.norm(np.ptp(positions, axis=0))
    d, e = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    plane = np.abs(d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0]) / 2
    corner = positions[faces]
    space = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 2
    known = space > 0
    order = np.argsort((plane[known] / space[known]))
    dense = np.sqrt(plane[known] / space[known])[order]
    below = np.cumsum(space[known][order]) / space.sum()
    low, high = (dense[min(np.searchsorted(below, q), len(dense) - 1)] for q in (0.05, 0.95))
    return islands, border / diagonal, plane.sum() / square, high / low


def ours(program, mesh):
    with tempfile.TemporaryDirectory() as folder:
        settings = ["pictures.enabled=false", "report.enabled=false", f"patches.padding={PADDING}"]
        command = [program, "build", mesh, "--out", folder, "--quiet"]
        subprocess.run(command + [word for s in settings for word in ("--set", s)], check=True)
        atlas = next(Path(folder).glob("*/atlas.json")).parent
        arrays = np.load(atlas / "atlas.npz")
        patches = json.loads((atlas / "atlas.json").read_text())["patches"]
        scale = np.array([p["patch_to_packed"]["scale"] for p in patches])
        shift = np.array([p["patch_to_packed"]["translation"] for p in patches])
        patch = arrays["patch"]
        uv = arrays["patch_uv"] * scale[patch][:, None, None] + shift[patch][:, None]
        return measure(arrays["positions"], arrays["faces"].astype(np.int64), uv, 1.0)


def theirs(mesh):
    positions, faces = igl.read_triangle_mesh(str(mesh))
    faces = faces.astype(np.int64)
    atlas = xatlas.Atlas()
    # Its own numbers are float32; the model's size must not matter to it.
    small = ((positions - positions.mean(axis=0)) / np.ptp(positions, axis=0).max()).astype(np.float32)
    atlas.add_mesh(small, faces.astype(np.uint32))
    options = xatlas.PackOptions()
    options.padding, options.resolution = PADDING, SIDE
    atlas.generate(pack_options=options)
    _, corners, uv = atlas.get_mesh(0)
    uv = uv * [atlas.width, atlas.height]
    return measure(positions, faces, uv[corners.astype(np.int64)], atlas.width * atlas.height)


def main(program, meshes):
    print("| model | islands | xatlas | borders | xatlas | filled | xatlas | density | xatlas |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for mesh in meshes:
        a, b = ours(program, mesh), theirs(mesh)
        words = [f"{a[0]}", f"{b[0]}"] + [f"{x:.{n}f}" for i, n in ((1, 1), (2, 2), (3, 2)) for x in (a[i], b[i])]
        print("|", Path(mesh).stem, "|", " | ".join(words), "|", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
