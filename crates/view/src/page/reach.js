// A simulated person around a pointer: where they look, and a hand with minimum-jerk reaches.

/** From a state of motion to rest at `to` in `duration` s: the quintic of least jerk (Flash and Hogan 1985). */
class Course {
  constructor(start, place, velocity, to, duration) {
    Object.assign(this, { start, place, velocity, to, duration });
  }

  at(t) {
    const T = this.duration, s = clamp((t - this.start) / T, 0, 1);
    const axis = (i) => {
      const d = this.to[i] - this.place[i], v = this.velocity[i] * T;
      const [a, b, c] = [10 * d - 6 * v, -15 * d + 8 * v, 6 * d - 3 * v];
      return [this.place[i] + s * (v + s * s * (a + s * (b + s * c))), (v + s * s * (3 * a + s * (4 * b + s * 5 * c))) / T];
    };
    const [x, y, z] = [0, 1, 2].map(axis);
    return { place: [x[0], y[0], z[0]], velocity: [x[1], y[1], z[1]], over: s >= 1 };
  }
}

/** A right hand that points: forwards, right, up from the tip of the index finger, m, in the order of OpenXR. */
const POINTING = [
  [-0.118, 0.020, -0.004], [-0.175, 0.020, 0.004],
  [-0.150, -0.010, -0.012], [-0.112, -0.030, -0.018], [-0.080, -0.028, -0.022], [-0.058, -0.016, -0.026],
  [-0.155, 0.006, 0.010], [-0.089, 0.000, 0.014], [-0.047, 0.000, 0.008], [-0.024, 0.000, 0.004], [0, 0, 0],
  [-0.150, 0.018, 0.010], [-0.085, 0.022, 0.014], [-0.052, 0.024, -0.006], [-0.062, 0.024, -0.032], [-0.083, 0.023, -0.036],
  [-0.150, 0.030, 0.006], [-0.091, 0.042, 0.010], [-0.062, 0.044, -0.012], [-0.072, 0.043, -0.034], [-0.090, 0.041, -0.036],
  [-0.152, 0.042, 0.000], [-0.101, 0.060, 0.003], [-0.078, 0.062, -0.014], [-0.086, 0.060, -0.031], [-0.100, 0.057, -0.033],
];
/** How deep a held touch presses, m; how long an arm is, m; how far a person stands from what they touch, m. */
const PRESS = 0.010, ARM = 0.66, STAND = 0.62, HEAD_SPEED = 0.9, STROKE_SPEED = 0.35;

class Reacher {
  constructor(floor) {
    this.floor = floor;
    this.goal = null;
    this.held = null;
    this.head = null;
    this.phase = Array.from({ length: 9 }, () => 2 * Math.PI * Math.random());
  }

  /** What is pointed at: place and outward normal; `null`: nothing. */
  aim(hit) {
    this.goal = hit;
    if (hit && !this.head) {
      this.head = this.standing(hit);
      this.tip = this.rest();
      this.velocity = [0, 0, 0];
    }
    if (hit && this.held && hit.surface === this.held.surface) this.held = hit;
  }

  press(now) {
    if (!this.goal || !this.head) return;
    this.held = this.goal;
    const to = along(this.held.point, this.held.normal, -PRESS);
    this.course = new Course(now, this.tip, this.velocity, to, clamp(0.55 + 0.25 * distance(this.tip, to), 0.6, 0.8));
  }

  release(now) {
    if (!this.held) return;
    this.held = null;
    this.course = new Course(now, this.tip, this.velocity, this.rest(), 0.6);
  }

  /** Where a head is from which a place is easily touched. */
  standing({ point, normal }) {
    const away = unit([normal[0], normal[1], 0], this.head ? unit([this.head[0] - point[0], this.head[1] - point[1], 0], [1, 0, 0]) : [1, 0, 0]);
    const side = cross([0, 0, 1], away);
    const at = along(along(point, away, STAND), side, -0.1);
    return [at[0], at[1], clamp(this.floor + 1.6, point[2] + 0.1, point[2] + 0.62)];
  }

  facing() {
    const at = (this.held ?? this.goal)?.point ?? this.looked ?? [0, 0, 0];
    const away = [at[0] - this.head[0], at[1] - this.head[1], 0];
    return unit(away, [-1, 0, 0]);
  }

  shoulder() {
    const ahead = this.facing(), right = cross(ahead, [0, 0, 1]);
    return along(add(this.head, [0, 0, -0.26]), right, 0.17);
  }

  rest() {
    const ahead = this.facing();
    return along(add(this.shoulder(), [0, 0, -0.16]), ahead, 0.26);
  }

  /** The person at a time, s. */
  step(now) {
    if (!this.head) return null;
    const dt = clamp(now - (this.before ?? now), 0, 0.1);
    this.before = now;
    const at = this.held ?? this.goal;
    if (at) this.looked = at.point;
    // They step towards a place beyond an arm's reach.
    if (this.goal && !this.held && !this.course) {
      const far = distance(this.shoulder(), this.goal.point) > ARM || dot(sub(this.head, this.goal.point), this.goal.normal) < 0.2;
      if (far) this.walk = this.standing(this.goal);
      if (this.walk) {
        const way = sub(this.walk, this.head), left = norm(way);
        this.head = left <= HEAD_SPEED * dt ? this.walk : along(this.head, way, (HEAD_SPEED * dt) / left);
        if (left < 0.01) this.walk = null;
      }
    }
    if (this.course) {
      const there = this.course.at(now);
      Object.assign(this, { tip: there.place, velocity: there.velocity });
      if (there.over) this.course = null;
    } else {
      // At rest it moves with the body, in a touch with the place that is pointed at.
      const wish = this.held ? along(this.held.point, this.held.normal, -PRESS) : this.rest();
      const way = sub(wish, this.tip), left = norm(way), speed = Math.min(8 * left, this.held ? STROKE_SPEED : 1.2);
      this.velocity = left > 1e-6 ? scale(way, speed / left) : [0, 0, 0];
      this.tip = along(this.tip, this.velocity, dt);
    }
    const tremor = [0, 1, 2].map((i) => [7.3, 9.1, 10.7].reduce((sum, f, k) => sum + 1.2e-4 * Math.sin(2 * Math.PI * f * now + this.phase[3 * i + k]), 0));
    const ahead = unit(sub(this.tip, this.shoulder())), right = unit(cross(ahead, [0, 0, 1]), [0, -1, 0]), up = cross(right, ahead);
    const joints = POINTING.map(([f, r, u]) => {
      const joint = add(along(along(along(this.tip, ahead, f), right, r), up, u), tremor);
      return joint.map((c) => c + 1.5e-4 * gauss());
    });
    const gaze = this.looked ? unit(sub(this.looked, this.head)) : ahead;
    return { joints, head: [...this.head, ...turnOf(gaze)], gaze };
  }
}

/** Of mean 0 and standard deviation 1. */
function gauss() {
  return Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());
}

/** Quaternion x, y, z, w of the turn that brings the x axis to a direction: yaw, then pitch. */
function turnOf([x, y, z]) {
  const yaw = Math.atan2(y, x) / 2, pitch = -Math.asin(clamp(z, -1, 1)) / 2;
  const [a, b, c, d] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  return [-b * d, a * d, b * c, a * c];
}
