"""Interaction primitives: against numpy's fits and the figures of the Rust documentation."""

import numpy as np
import pytest

import hwall
from hwall import bip


def reach(depth, duration):
    """The reach of crates/bip/README.md: minimum jerk with tremor, 50 Hz; the arm moves to meet the hand."""
    t = np.linspace(0.0, 1.0, int(50 * duration))
    gone = t**3 * (10 - 15 * t + 6 * t * t)
    return np.column_stack([depth * gone + 1e-3 * np.sin(7 * t + 40 * depth), 1 - (1 - depth) * gone])


DEPTHS = [(0.40, 1.0), (0.50, 1.3), (0.55, 0.9), (0.62, 1.1), (0.70, 1.2)]
REACHES = [reach(*reached) for reached in DEPTHS]


@pytest.fixture(scope="module")
def model():
    return bip.fit(REACHES, observed=[0], period=0.02, functions=7)


def test_the_end_is_predicted(model):
    # crates/bip/README.md: a new reach, 0.58 m deep, with the hand observed for the first 70 %.
    seen, filter = reach(0.58, 1.1), model.filter()
    for sample in seen[: len(seen) * 7 // 10]:
        assert filter.update(sample[:1])
    end = filter.predict()
    assert abs(end.mean[1] - 0.58) < 0.03 and abs(filter.phase - 0.7) < 0.05
    left, sd = filter.time_to_end
    assert abs(left - 0.33) < 0.1 and sd > 0.0
    assert filter.hypotheses[:, 0].sum() == pytest.approx(1.0) and filter.resting < 0.01


def test_the_mean_is_the_mean_of_fits_by_numpy(model):
    phases = np.linspace(0.0, 1.0, 11)
    fits = [np.polynomial.Polynomial.fit(np.linspace(0, 1, len(r)), r[:, 0], 6) for r in REACHES]
    expected = np.mean([fit(phases) for fit in fits], axis=0)
    assert np.abs(model.mean(phases)[:, 0] - expected).max() < 1e-9
    assert np.array_equal(model.mean(0.5), model.mean([0.5])[0])


def test_intervals_are_normal(model):
    scipy = pytest.importorskip("scipy.stats")
    filter = model.filter()
    for sample in REACHES[2][:20]:
        filter.update(sample[:1])
    for level in (0.5, 0.9, 0.999):
        end = filter.predict([0.6, 1.0], level=level)
        z = scipy.norm.ppf(0.5 + 0.5 * level)
        assert end.mean.shape == (2, 2)
        assert np.allclose(end.high - end.mean, z * end.sd, rtol=1e-12)
        assert np.allclose(end.mean - end.low, z * end.sd, rtol=1e-12)


def test_intervals_of_90_percent_hold_most_ends():
    rng = np.random.default_rng(5)
    reaches = [reach(rng.uniform(0.35, 0.75), rng.uniform(0.8, 1.4)) for _ in range(60)]
    model = bip.fit(reaches[:30], observed=[0], period=0.02, functions=7)
    inside = 0
    for new in reaches[30:]:
        filter = model.filter()
        for sample in new[: len(new) // 2]:
            filter.update(sample[:1])
        end = filter.predict()
        inside += end.low[0] <= new[-1, 0] <= end.high[0]
    assert inside >= 24


def test_the_published_filter_is_a_plain_extended_kalman_filter():
    count, powers = 5, np.arange(5)
    model = bip.fit(REACHES, [0], basis="polynomial", functions=count, tune=False, published=True)

    def at(phase, derivative=False):
        x = 2 * phase - 1
        return 2 * powers * x ** np.maximum(powers - 1, 0) if derivative else x**powers

    weights, residuals = [], []
    for reach_ in REACHES:
        rows = np.array([at(phase) for phase in np.linspace(0, 1, len(reach_))])
        fitted = np.linalg.lstsq(rows, reach_, rcond=None)[0]
        weights.append(fitted.T.ravel())
        residuals.append(np.mean((rows @ fitted - reach_)[:, 0] ** 2))
    rates = [1 / len(reach_) for reach_ in REACHES]
    state = np.r_[0, np.mean(rates), np.mean(weights, axis=0)]
    covariance = np.zeros((12, 12))
    covariance[0, 0], covariance[1, 1] = 1e-4, np.var(rates)
    covariance[2:, 2:] = np.cov(np.array(weights), rowvar=False)
    step, process = np.eye(12), np.zeros((12, 12))
    step[0, 1] = 1
    process[:2, :2] = 1e-8 * np.array([[0.25, 0.5], [0.5, 1]])
    filter = model.filter(published=True)
    for x in reach(0.58, 1.1)[:, 0]:
        state, covariance = step @ state, step @ covariance @ step.T + process
        state[0] = np.clip(state[0], 0, 1)
        row = np.r_[at(state[0], True) @ state[2:7], 0, at(state[0]), np.zeros(count)]
        gain = covariance @ row / (row @ covariance @ row + np.mean(residuals))
        state = state + gain * (x - at(state[0]) @ state[2:7])
        state[0] = np.clip(state[0], 0, 1)
        keep = np.eye(12) - np.outer(gain, row)
        covariance = keep @ covariance @ keep.T + np.mean(residuals) * np.outer(gain, gain)
        filter.update([x])
        assert filter.phase == pytest.approx(state[0], abs=1e-9)
        assert filter.predict().mean == pytest.approx(at(1.0) @ state[2:].reshape(2, count).T, abs=1e-8)


def test_files_and_times(model, tmp_path):
    model.save(tmp_path / "model.json")
    again = bip.load(tmp_path / "model.json")
    assert again.columns == 2 and again.observed == [0] and again.demonstrations == 5
    a, b = model.filter(), again.filter()
    for sample in REACHES[0][:30]:
        a.update(sample[:1])
        b.update(sample[:1])
    assert np.array_equal(a.predict().mean, b.predict().mean)
    times = [0.02 * np.arange(len(r)) for r in REACHES]
    timed = bip.fit(REACHES, [0], times=times, functions=7)
    assert np.allclose(timed.mean(0.4), model.mean(0.4), atol=1e-12)
    (tmp_path / "cut.json").write_text((tmp_path / "model.json").read_text()[:500])
    with pytest.raises(hwall.Error):
        bip.load(tmp_path / "cut.json")
    with pytest.raises(hwall.Error, match="No such file"):
        bip.load(tmp_path / "none.json")


def test_an_end_that_is_known_otherwise_counts(model):
    told = model.filter()
    for sample in REACHES[0][:15]:
        told.update(sample[:1])
    before = told.predict().sd[1]
    told.observe_at([0.45], 0.005, [1])
    after = told.predict()
    assert after.sd[1] < before and abs(after.mean[1] - 0.45) < 0.02


def test_bad_samples_leave_the_filter_as_it_was(model):
    filter = model.filter()
    filter.update(REACHES[0][0, :1])
    before = filter.predict().mean
    for bad, words in [
        (lambda: filter.update([np.nan]), "x[0] is NaN, not a finite number"),
        (lambda: filter.update([1.0, 2.0]), "x has the shape (2,), it must be (1,)"),
        (lambda: filter.update([1.0], columns=[2]), "there is no column 2 among 2"),
        (lambda: filter.update([1.0], dt=-1.0), "-1"),
        (lambda: filter.predict(level=1.0), "level is 1, it must be above 0 and below 1"),
    ]:
        with pytest.raises(hwall.Error) as refused:
            bad()
        assert words in str(refused.value)
    assert np.array_equal(filter.predict().mean, before)


@pytest.mark.parametrize(
    ("fit", "words"),
    [
        (lambda: bip.fit([np.full((5, 2), np.nan)]), "row 0: row 0, column 0 is NaN, not a finite number"),
        (lambda: bip.fit([np.zeros(5)]), "demonstration 0 has the shape (5,), it must be (samples, columns)"),
        (lambda: bip.fit([]), "0 demonstrations, 3 are needed"),
        (lambda: bip.fit([], [0], tune=False), "0 demonstrations, 1 are needed"),
        (lambda: bip.fit(REACHES, [7]), "there is no column 7 among 2"),
        (lambda: bip.fit(REACHES, times=[[0.0]]), "5 demonstrations and 1 times"),
        (lambda: bip.fit(REACHES, basis="spline"), 'basis "spline" is not one of legendre'),
        (lambda: bip.fit(REACHES, period=0.0), "sampling period is 0, it must be positive"),
    ],
)
def test_bad_demonstrations_are_refused(fit, words):
    with pytest.raises(hwall.Error) as refused:
        fit()
    assert words in str(refused.value)
