"""Where will a motion end? Your own CSV: columns trial, t, then one for each value. `python bip_on_csv.py [motions.csv]`"""

import sys

import numpy as np

from hwall import bip


def some_motions():
    """Reaches to different depths, if no file is given."""
    rng = np.random.default_rng(1)
    for trial in range(25):
        depth, t = rng.uniform(0.4, 0.7), np.linspace(0, rng.uniform(0.8, 1.2), 50)
        tau = t / t[-1]
        x = depth * tau**3 * (10 - 15 * tau + 6 * tau**2) + 0.002 * np.sin(9 * tau + 50 * depth)
        yield from np.column_stack([np.full(50, trial), t, x, 0.1 * x + rng.normal(0, 0.001, 50)])


rows = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1) if len(sys.argv) > 1 else np.array(list(some_motions()))
trials = [rows[rows[:, 0] == trial] for trial in np.unique(rows[:, 0])]
known, new = trials[:-1], trials[-1]

# The first value is seen, the others are inferred.
model = bip.fit([trial[:, 2:] for trial in known], observed=[0], times=[trial[:, 1] for trial in known])
filter = model.filter()
for k, row in enumerate(new):
    filter.update(row[2:3], dt=new[max(k, 1), 1] - new[max(k, 1) - 1, 1])
    if k % (len(new) // 5) == 0:
        end, left = filter.predict(level=0.9), filter.time_to_end
        print(f"{filter.phase:4.0%}  end {end.mean[0]:.3f}, 90 % in [{end.low[0]:.3f}, {end.high[0]:.3f}]",
              f"  {left[0]:.2f} s left" if left else "")
print(f"truly {new[-1, 2]:.3f}")
