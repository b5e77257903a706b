//! Invalid configurations and steps of objects are refused by name.

use hwall_haptics::{Click, Detent, MovingObject, ObjectConfig};
use hwall_testkit::{refusal, refused};

#[test]
fn bad_configurations_are_named() {
    let good = || ObjectConfig::new(2.0);
    let click = Click {
        start: 0.001,
        snap: 0.003,
        release: 0.002,
        force: 3.0,
    };
    let detent = Detent {
        position: 0.0,
        half_width: 0.1,
        force: 2.0,
    };
    let with_click = |click| ObjectConfig {
        click: Some(click),
        ..good()
    };
    let with_detent = |detent| ObjectConfig {
        detents: vec![detent],
        ..good()
    };
    const NAN: f64 = f64::NAN;
    refused!(good(), MovingObject::new, {
        inertia = 0.0, NAN;
        stiffness = -1.0, NAN;
        rest = NAN;
        damping = -1e-9, 1e200, f64::INFINITY;
        friction = -2.0;
        range = [NAN, 1.0], [f64::INFINITY; 2] => "range[0]";
        range = [0.0, NAN], [1.0, 0.0] => "range[1]";
        restitution = 1.1, NAN;
    });
    let light = ObjectConfig {
        inertia: 1e-300,
        ..good()
    };
    refused!(light, MovingObject::new, {
        stiffness = 1e300;
    });
    refused!(detent, |detent| MovingObject::new(with_detent(detent)), {
        position = NAN => "detent position";
        half_width = 0.0 => "detent half_width";
        force = -1.0 => "detent force";
    });
    refused!(click, |click| MovingObject::new(with_click(click)), {
        start = NAN => "click start";
        snap = 0.001 => "click snap";
        release = 0.004, 0.0 => "click release";
        force = NAN => "click force";
    });
    for config in [good(), with_click(click), with_detent(detent)] {
        assert!(config.validate().is_ok());
    }
}

#[test]
fn bad_steps_change_nothing() {
    let mut moving = MovingObject::new(ObjectConfig {
        range: [-1.0, 1.0],
        ..ObjectConfig::new(2.0)
    })
    .unwrap();
    moving.set_state(0.25, 0.5).unwrap();
    let nan = f64::NAN;
    for (force, dt_s, name) in [
        (nan, 1e-3, "force"),
        (f64::INFINITY, 1e-3, "force"),
        (1.0, nan, "dt_s"),
        (1.0, -1e-3, "dt_s"),
        (1.0, f64::INFINITY, "dt_s"),
    ] {
        let message = refusal(moving.step(force, dt_s));
        assert!(message.starts_with(name), "{message}");
    }
    for (position, velocity, name) in [
        (nan, 0.0, "position"),
        (1.1, 0.0, "position"),
        (0.0, nan, "velocity"),
    ] {
        let message = refusal(moving.set_state(position, velocity));
        assert!(message.starts_with(name), "{message}");
    }
    assert_eq!((moving.position(), moving.velocity()), (0.25, 0.5));
    moving.step(5.0, 0.0).unwrap();
    assert_eq!((moving.position(), moving.velocity()), (0.25, 0.5));
    // A motion that overflows is an error, not an infinity.
    let mut free = MovingObject::new(ObjectConfig::new(1e-6)).unwrap();
    assert!(free.step(1e300, 1e10).is_err());
    assert_eq!((free.position(), free.velocity()), (0.0, 0.0));
}

#[test]
fn an_object_starts_at_zero_or_at_the_stop_next_to_it() {
    for (range, start) in [([-1.0, 1.0], 0.0), ([0.2, 1.0], 0.2), ([-1.0, -0.3], -0.3)] {
        let config = ObjectConfig {
            range,
            ..ObjectConfig::default()
        };
        let moving = MovingObject::new(config).unwrap();
        assert_eq!((moving.position(), moving.velocity()), (start, 0.0));
    }
}
