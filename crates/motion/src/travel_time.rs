//! Least time of a single joint from rest to rest.

/// Least time for a distance (rad, not negative) under limits of speed, acceleration and jerk, s.
///
/// The acceleration rises, stays and falls, or only rises and falls; likewise the speed. Source: the cases of a double-S profile from rest to rest,
/// [Biagiotti and Melchiorri 2008], section 3.4.
pub(crate) fn travel_time_s(distance: f64, velocity: f64, acceleration: f64, jerk: f64) -> f64 {
    if distance == 0.0 {
        return 0.0;
    }
    let full_rise_s = acceleration / jerk;
    let speed_up_s = speed_up_s(full_rise_s, velocity, acceleration, jerk);
    if distance >= velocity * speed_up_s {
        return speed_up_s + distance / velocity;
    }
    if distance >= 2.0 * acceleration * full_rise_s * full_rise_s {
        let half = 0.5 * full_rise_s;
        2.0 * (half + (half * half + distance / acceleration).sqrt())
    } else {
        4.0 * (distance / (2.0 * jerk)).cbrt()
    }
}

/// The largest distance of a joint from rest to rest in a time (s, not negative), rad: the inverse of [`travel_time_s`].
pub(crate) fn farthest_rad(time_s: f64, velocity: f64, acceleration: f64, jerk: f64) -> f64 {
    let full_rise_s = acceleration / jerk;
    let speed_up_s = speed_up_s(full_rise_s, velocity, acceleration, jerk);
    if time_s >= 2.0 * speed_up_s {
        return velocity * (time_s - speed_up_s);
    }
    if time_s >= 4.0 * full_rise_s {
        let half = 0.5 * full_rise_s;
        let root = 0.5 * time_s - half;
        acceleration * (root * root - half * half)
    } else {
        let quarter = 0.25 * time_s;
        2.0 * jerk * quarter * quarter * quarter
    }
}

/// Time until the joint reaches full speed, s.
fn speed_up_s(full_rise_s: f64, velocity: f64, acceleration: f64, jerk: f64) -> f64 {
    if velocity >= acceleration * full_rise_s {
        full_rise_s + velocity / acceleration
    } else {
        2.0 * (velocity / jerk).sqrt()
    }
}
