"""Which surface will the hand touch, where and when? A person reaches; predictions come with every frame of the tracker."""

import numpy as np

import hwall
from hwall import contact, sim

ROOM = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 2\nv 0.6 -1 2\nf 1 2 3 4\no shelf\nv 0.9 0.4 0\nv 0.9 0.8 0\nv 0.9 0.8 2\nv 0.9 0.4 2\nf 5 6 7 8\n"
scene = hwall.Scene.from_obj_str(ROOM)
rng = np.random.default_rng(1)


def touches(person, count):
    """Points on wall and shelf that a person touches."""
    on_wall = np.column_stack([np.full(count, 0.6), rng.uniform(-0.5, 0.3, count), rng.uniform(0.8, 1.4, count)])
    on_shelf = np.column_stack([np.full(count, 0.9), rng.uniform(0.45, 0.75, count), rng.uniform(0.8, 1.4, count)])
    return sim.Person(person).plan(np.where(rng.random((count, 1)) < 0.7, on_wall, on_shelf), [1, 0, 0])


reaches = []
for plan in (touches(person, 10) for person in range(6)):
    for touch in plan.truth:
        t = np.arange(touch["start"], touch["contact"], 1 / 72)
        path = np.array([plan.tip(at)[0] for at in t])
        reaches.append(contact.Reach(t, path, contact=touch["target"], contact_time=touch["contact"]))
model = contact.LearnedModel.fit(reaches)

plan = touches(99, 1)
truth, predictor = plan.truth[0], contact.Predictor(scene, model, simulated=True)
for k, t in enumerate(np.arange(0, truth["contact"], 1 / 72)):
    ranked = predictor.step(plan.frame(t))
    if ranked and k % 10 == 0:
        best, miss = ranked[0], np.linalg.norm(ranked[0]["point"] - truth["target"])
        print(f"{truth['contact'] - t:5.2f} s before: {best['surface']} {best['probability']:4.0%}, {1e3 * miss:4.0f} mm off")
