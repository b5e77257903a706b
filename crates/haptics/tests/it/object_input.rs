//! Configurations and steps of objects that make no sense are refused by name.

use hwall_haptics::{Click, Detent, MovingObject, ObjectConfig};

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
    let nan = f64::NAN;
    let cases = [
        (ObjectConfig::new(0.0), "inertia"),
        (ObjectConfig::new(-1.0), "inertia"),
        (ObjectConfig::new(nan), "inertia"),
        (ObjectConfig::new(f64::INFINITY), "inertia"),
        (
            ObjectConfig {
                stiffness: -1.0,
                ..good()
            },
            "stiffness",
        ),
        (
            ObjectConfig {
                stiffness: nan,
                ..good()
            },
            "stiffness",
        ),
        (
            ObjectConfig {
                stiffness: 1e300,
                ..ObjectConfig::new(1e-300)
            },
            "stiffness",
        ),
        (
            ObjectConfig {
                rest: nan,
                ..good()
            },
            "rest",
        ),
        (
            ObjectConfig {
                damping: -1e-9,
                ..good()
            },
            "damping",
        ),
        (
            ObjectConfig {
                damping: f64::INFINITY,
                ..good()
            },
            "damping",
        ),
        (
            ObjectConfig {
                damping: 1e200,
                ..good()
            },
            "damping",
        ),
        (
            ObjectConfig {
                friction: -2.0,
                ..good()
            },
            "friction",
        ),
        (
            ObjectConfig {
                range: [nan, 1.0],
                ..good()
            },
            "range[0]",
        ),
        (
            ObjectConfig {
                range: [0.0, nan],
                ..good()
            },
            "range[1]",
        ),
        (
            ObjectConfig {
                range: [1.0, 0.0],
                ..good()
            },
            "range[1]",
        ),
        (
            ObjectConfig {
                range: [f64::INFINITY, f64::INFINITY],
                ..good()
            },
            "range[0]",
        ),
        (
            ObjectConfig {
                restitution: 1.1,
                ..good()
            },
            "restitution",
        ),
        (
            ObjectConfig {
                restitution: nan,
                ..good()
            },
            "restitution",
        ),
        (
            with_detent(Detent {
                position: nan,
                ..detent
            }),
            "detent position",
        ),
        (
            with_detent(Detent {
                half_width: 0.0,
                ..detent
            }),
            "detent half_width",
        ),
        (
            with_detent(Detent {
                force: -1.0,
                ..detent
            }),
            "detent force",
        ),
        (
            with_click(Click {
                start: nan,
                ..click
            }),
            "click start",
        ),
        (
            with_click(Click {
                snap: 0.001,
                ..click
            }),
            "click snap",
        ),
        (
            with_click(Click {
                release: 0.004,
                ..click
            }),
            "click release",
        ),
        (
            with_click(Click {
                release: 0.0,
                ..click
            }),
            "click release",
        ),
        (
            with_click(Click {
                force: nan,
                ..click
            }),
            "click force",
        ),
    ];
    for (config, name) in cases {
        let message = MovingObject::new(config.clone()).unwrap_err().to_string();
        assert!(
            message.starts_with(name),
            "{message:?} does not name {name}"
        );
    }
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
        let message = moving.step(force, dt_s).unwrap_err().to_string();
        assert!(message.starts_with(name), "{message}");
    }
    for (position, velocity, name) in [
        (nan, 0.0, "position"),
        (1.1, 0.0, "position"),
        (0.0, nan, "velocity"),
    ] {
        let message = moving
            .set_state(position, velocity)
            .unwrap_err()
            .to_string();
        assert!(message.starts_with(name), "{message}");
    }
    assert_eq!((moving.position(), moving.velocity()), (0.25, 0.5));
    moving.step(5.0, 0.0).unwrap();
    assert_eq!((moving.position(), moving.velocity()), (0.25, 0.5));
    // A motion beyond the numbers is an error, not an infinity.
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
