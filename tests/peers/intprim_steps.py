"""Times one recursive step of IntPrim 2.0, one thread, beside hwall-bip on the same motions.

Usage: intprim_steps.py --intprim FOLDER_WITH_THE_PACKAGE --workload FOLDER_OF_CSV

Needs numpy, scipy, scikit-learn, matplotlib and the sources of IntPrim (GitHub ir-lab/intprim,
HEAD 8994b15): FOLDER_WITH_THE_PACKAGE is the one that holds `intprim/`. Expected repairs:
- imports of Python 3 (`from intprim.basis import basis_model` and the like); those of `examples`,
  `util` and `filter.kf` are left out;
- `basis/selection.py`: `np.sum` of a generator becomes `sum`;
- `filter/spatiotemporal/ekf.py`: `self.basis_model.inverse_transform(w)` becomes `w`.

FOLDER_OF_CSV: train_*.csv and test_*.csv, a header, one row a sample, 18 columns of the hand and 7
of the arm. Every basis is wrapped in a MixtureModel, and the cache of basis values is off: it makes
results depend on earlier calls. Phases are compared with `../poly_B8/ekf_intprim.json` where that
exists; a difference above 1e-8 ends the program with an error.

Printed for each basis: size of the state, median and 99th percentile of a call with one sample:
- filter: `localize`, prediction and update alone;
- generate: `generate_probable_trajectory_recursive`, which adds the mean of all degrees of freedom
  at the estimated phase (one sample out);
- moments: `localize` and `get_projected_mean_covariance`, which adds their covariance too.
"""

import os

for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "BLIS"):
    os.environ[f"{name}_NUM_THREADS"] = "1"

import argparse
import json
import sys
from pathlib import Path
from time import perf_counter

import numpy as np

HAND, ARM = 18, 7
DOFS = HAND + ARM
ACTIVE = np.arange(HAND)
PHASE_VARIANCE, PROCESS_VARIANCE = 1e-4, 1e-8
UNOBSERVED_NOISE = 1e4
TOLERANCE = 1e-8


def motions(folder: Path, kind: str) -> list:
    """One array a file, a row a degree of freedom."""
    files = sorted(folder.glob(f"{kind}_*.csv"))
    return [np.loadtxt(f, delimiter=",", skiprows=1).T for f in files]


def polynomials(intprim):
    return intprim.basis.PolynomialModel(8, np.array(["x"] * DOFS))


def gaussians(intprim, count: int, dofs: int):
    """Standard deviation: the distance of the centres. Without the cache."""
    names = np.array(["x"] * dofs)
    basis = intprim.basis.GaussianModel(count, (1 / (count - 1)) ** 2, names, 0.0, 1.0)
    basis.get_basis_values = basis.compute_basis_values
    return basis


class Contestant:
    """A trained primitive with what a new filter needs."""

    def __init__(self, intprim, bases: list, train: list) -> None:
        self.filter = intprim.filter.spatiotemporal.ExtendedKalmanFilter
        self.basis = intprim.basis.MixtureModel(bases)
        self.primitive = intprim.BayesianInteractionPrimitive(self.basis)
        selection = intprim.basis.Selection(np.array(["x"] * DOFS))
        for motion in train:
            self.primitive.add_demonstration(motion)
            selection.add_demonstration(motion)
        noise = selection.get_model_mse(self.basis, np.arange(DOFS))
        noise[HAND:] += UNOBSERVED_NOISE
        self.noise = np.diag(noise)
        self.velocities = [1 / motion.shape[1] for motion in train]

    def start(self) -> None:
        self.primitive.set_filter(
            self.filter(
                self.basis,
                [0.0, np.mean(self.velocities)],
                [PHASE_VARIANCE, np.var(self.velocities)],
                PROCESS_VARIANCE,
                *self.primitive.get_basis_weight_parameters(),
            )
        )

    def step(self, call: str, sample) -> float:
        bip = self.primitive
        if call == "generate":
            args = (sample, self.noise, ACTIVE)
            return bip.generate_probable_trajectory_recursive(*args, num_samples=1)[1]
        phase = bip.filter.localize(sample.T, self.noise, ACTIVE)[0]
        if call == "moments":
            bip.filter.get_projected_mean_covariance(None)
        return phase

    def end(self):
        """Mean of all degrees of freedom at the end of the motion."""
        return self.primitive.filter.get_projected_mean_covariance(1.0)[0]

    def follow(self, motion, call: str):
        """Phases and times, us, of all steps of one motion."""
        seen = motion.copy()
        seen[HAND:] = 0.0
        self.start()
        phases, times = [], []
        for k in range(seen.shape[1]):
            sample = seen[:, k : k + 1]
            begin = perf_counter()
            phases.append(self.step(call, sample))
            times.append(1e6 * (perf_counter() - begin))
        return phases, times


def check(file: Path, phases: list) -> None:
    with open(file, encoding="utf-8") as text:
        runs = json.load(text)["tests"]
    differences = []
    for run in runs:
        n = run["roundoff_ok_steps"]
        differences.extend(np.abs(np.array(phases[run["id"]][:n]) - run["phase"][:n]))
    worst = np.max(differences)
    print(f"phases against {file.name}: {len(differences)} steps, difference at most {worst:.1e}")
    if not worst <= TOLERANCE:
        sys.exit(f"more than {TOLERANCE}")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--intprim", type=Path, required=True)
    parser.add_argument("--workload", type=Path, required=True)
    args = parser.parse_args()
    sys.path.insert(0, str(args.intprim))
    import intprim

    train, test = motions(args.workload, "train"), motions(args.workload, "test")
    eight = [polynomials(intprim)]
    mixed = [gaussians(intprim, 18, HAND), gaussians(intprim, 7, ARM)]
    reference = args.workload.resolve().parent / "poly_B8" / "ekf_intprim.json"
    for name, bases in (("polynomial 8", eight), ("Gaussian 18/7", mixed)):
        contestant = Contestant(intprim, bases, train)
        contestant.follow(test[0], "moments")  # warm
        for call in ("filter", "generate", "moments"):
            runs = [contestant.follow(motion, call) for motion in test]
            times = np.concatenate([t for _, t in runs])
            size = contestant.primitive.filter.state_dimension
            median, p99 = np.percentile(times, [50, 99])
            print(
                f"{name}, {call}: state {size}, {len(times)} steps,"
                f" median {median:.1f} us, p99 {p99:.1f} us"
            )
            if bases is eight and reference.is_file():
                check(reference, [p for p, _ in runs])


if __name__ == "__main__":
    main()
