//! Position-dependent forces as piecewise linear springs.

use super::config::ObjectConfig;
use super::oscillator::Oscillator;

/// An interval in which the object is a single damped oscillator.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) oscillator: Oscillator,
    /// Sum of the springs, N/m or N m/rad.
    stiffness: f64,
    /// Their equilibrium.
    anchor: f64,
}

impl Piece {
    /// Force of the springs, N or N m.
    pub(super) fn force(&self, position: f64) -> f64 {
        self.stiffness * (self.anchor - position)
    }
}

/// The pieces of an object from stop to stop; for a button, while its click is armed and after it.
///
/// At an edge the force may jump, but with rising position only upwards (a latch lets go, a click gives way). So no edge holds an object between two
/// forces that both push towards it.
#[derive(Debug, Clone)]
pub(super) struct PieceTable {
    range: [f64; 2],
    armed: Vec<Piece>,
    released: Vec<Piece>,
    /// Where a click lets go and where it is armed again; infinite without a click.
    snap: f64,
    release: f64,
}

impl PieceTable {
    /// For a valid configuration.
    pub(super) fn of(config: &ObjectConfig) -> Self {
        let (snap, release) = config
            .click
            .map_or((f64::INFINITY, f64::NEG_INFINITY), |c| (c.snap, c.release));
        let released = match config.click {
            Some(_) => pieces(config, false),
            None => Vec::new(),
        };
        Self {
            range: config.range,
            armed: pieces(config, true),
            released,
            snap,
            release,
        }
    }

    /// The same springs with another inertia and damping.
    pub(super) fn set_inertia(&mut self, inertia: f64, damping: f64) {
        for piece in self.armed.iter_mut().chain(&mut self.released) {
            piece.oscillator = Oscillator::new(inertia, damping, piece.stiffness);
        }
    }

    /// Is a click armed when the object is placed at a position?
    pub(super) fn armed_at(&self, position: f64) -> bool {
        position < self.snap
    }

    /// The piece that an object enters or crosses when it leaves a position upwards or downwards, and whether its click is armed there; `None` at the
    /// stop in that direction.
    pub(super) fn towards(&self, up: bool, position: f64, armed: bool) -> Option<(&Piece, bool)> {
        let armed = if up {
            armed && position < self.snap
        } else {
            armed || position <= self.release
        };
        let table = if armed { &self.armed } else { &self.released };
        let piece = if up {
            let inside = position < self.range[1];
            table.iter().find(|p| inside && position < p.high)
        } else {
            let inside = position > self.range[0];
            table.iter().rev().find(|p| inside && position > p.low)
        };
        piece.map(|piece| (piece, armed))
    }
}

fn pieces(config: &ObjectConfig, armed: bool) -> Vec<Piece> {
    // Each spring with the interval in which it acts.
    let mut springs = vec![(
        config.stiffness,
        config.rest,
        [f64::NEG_INFINITY, f64::INFINITY],
    )];
    springs.extend(
        config
            .detents
            .iter()
            .map(|d| (d.stiffness(), d.position, d.edges())),
    );
    if let Some(click) = config.click.filter(|_| armed) {
        springs.push((click.stiffness(), click.start, [click.start, click.snap]));
    }
    let [low, high] = config.range;
    let mut edges = vec![low, high];
    edges.extend(springs.iter().flat_map(|spring| spring.2));
    // A released click is armed again at its own edge.
    edges.extend(config.click.map(|click| click.release));
    edges.retain(|&edge| (low..=high).contains(&edge));
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    let piece = |low: f64, high: f64| {
        let acting = springs
            .iter()
            .filter(|(_, _, [from, to])| *from <= low && high <= *to);
        let (mut stiffness, mut moment) = (0.0, 0.0);
        for (k, anchor, _) in acting {
            stiffness += k;
            moment += k * anchor;
        }
        Piece {
            low,
            high,
            oscillator: Oscillator::new(config.inertia, config.damping, stiffness),
            stiffness,
            anchor: if stiffness > 0.0 {
                moment / stiffness
            } else {
                0.0
            },
        }
    };
    edges
        .windows(2)
        .filter_map(|pair| match pair {
            [low, high] => Some(piece(*low, *high)),
            _ => None,
        })
        .collect()
}
