"""Where on a wall in front of it can an iiwa 7 hold a board, and why not elsewhere? `python verdict_and_plot.py [picture.png]`"""

import sys

import matplotlib
import numpy as np

import hwall

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PLANE = 0.5  # distance of the wall from the base, m
arm = hwall.Arm.iiwa7()

# Verdicts on 20,000 poses at once, in the middles of cells of 9 x 17 mm: the flange points at the wall, x forward.
s, z = np.meshgrid(np.linspace(-0.8955, 0.8955, 200), np.linspace(-0.4915, 1.1915, 100))
poses = np.tile(np.eye(4), (s.size, 1, 1))
poses[:, :3, :3] = np.column_stack([[0, 1, 0], [0, 0, 1], [1, 0, 0]])
poses[:, :3, 3] = np.column_stack([np.full(s.size, PLANE), s.ravel(), z.ravel()])
verdicts = arm.verdict(poses)
for code, count in zip(*np.unique(verdicts.code, return_counts=True)):
    print(f"{count:6} {verdicts.KINDS[code] or 'reachable'}")

# The same wall as proven polygons with holes.
region = hwall.wall_region(arm, 0.0, PLANE, heights=[-0.5, 1.2])
print(f"reachable: {region.area:.4f} m2, by the verdicts {verdicts.reachable.mean() * 1.8 * 1.7:.4f} m2")

plt.pcolormesh(s, z, verdicts.code.reshape(s.shape), cmap="tab10", vmin=0, vmax=9, shading="nearest")
for polygon in region.polygons:
    for ring in polygon:
        plt.plot(*np.vstack([ring, ring[:1]]).T, "k")
plt.xlabel("along the wall, m"), plt.ylabel("height, m"), plt.axis("equal")
plt.savefig(sys.argv[1] if len(sys.argv) > 1 else "verdict.png")
