"""Texture atlases of other programs, for `cargo bench --bench images -- --peers DIR MESH...`.

    pip install numpy xatlas libigl
    python3 benches/peers/atlases.py DIR MESH...

Writes DIR/NAME.xatlas.obj, and for disks DIR/NAME.lscm.obj and DIR/NAME.slim.obj: the mesh as it is, with texture coordinates.
"""

import sys
from pathlib import Path

import igl
import numpy as np
import xatlas

SLIM_ITERATIONS = 50


def write(path, positions, faces, corners, uv):
    with open(path, "w") as out:
        out.writelines("v %.17g %.17g %.17g\n" % tuple(p) for p in positions)
        out.writelines("vt %.9g %.9g\n" % tuple(p) for p in uv)
        for f, c in zip(faces + 1, corners + 1):
            out.write("f %d/%d %d/%d %d/%d\n" % (f[0], c[0], f[1], c[1], f[2], c[2]))


def main(folder, meshes):
    folder.mkdir(parents=True, exist_ok=True)
    for mesh in meshes:
        positions, faces = igl.read_triangle_mesh(str(mesh))
        faces = faces.astype(np.int64)
        atlas = xatlas.Atlas()
        # Its own numbers are float32; the model's size must not matter to it.
        size = np.ptp(positions, axis=0).max()
        small = ((positions - positions.mean(axis=0)) / size).astype(np.float32)
        atlas.add_mesh(small, faces.astype(np.uint32))
        atlas.generate()
        _, corners, uv = atlas.get_mesh(0)
        # Its coordinates are parts of a picture that need not be square.
        uv = uv * [atlas.width, atlas.height]
        corners = corners.astype(np.int64)
        write(folder / f"{mesh.stem}.xatlas.obj", positions, faces, corners, uv)
        print(mesh.stem, "xatlas:", atlas.chart_count, "charts")
        loops = igl.boundary_loop_all(faces)
        vertices = np.unique(faces).size
        edges = len(igl.edges(faces))
        if len(loops) != 1 or vertices - edges + len(faces) != 1:
            continue
        loop = np.array(loops[0])
        ends = loop[[0, len(loop) // 2]]
        lscm, _ = igl.lscm(positions, faces, ends, np.array([[0.0, 0.0], [1.0, 0.0]]))
        write(folder / f"{mesh.stem}.lscm.obj", positions, faces, faces, lscm)
        circle = igl.map_vertices_to_circle(positions, loop)
        start = igl.harmonic(positions, faces, loop, circle, 1)
        area = igl.doublearea(positions, faces).sum() / 2
        start = np.asfortranarray(np.c_[start * np.sqrt(area / np.pi), np.zeros(len(start))][:, :2])
        data = igl.slim_precompute(
            np.asfortranarray(positions),
            np.asfortranarray(faces.astype(np.int32)),
            start,
            igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
            np.zeros(0, dtype=np.int32),
            np.asfortranarray(np.zeros((0, 2))),
            0.0,
        )
        slim = igl.slim_solve(data, SLIM_ITERATIONS)[:, :2]
        write(folder / f"{mesh.stem}.slim.obj", positions, faces, faces, slim)
        print(mesh.stem, "LSCM and SLIM")


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(m) for m in sys.argv[2:]])
